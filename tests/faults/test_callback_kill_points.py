"""The power of the controller, or the PC, goes at any point of a change that calls back.

After RobolinkRestore the tool is the old one, or one that was proved; and the next calibration
settles what was open.
"""

import threading

import pytest

from robolink import checkpoints
from robolink.checkpoints import Checkpoint
from tests.faults._callback_cell import IDENTITY, CallbackCell
from tests.faults._callback_sensors import BeamCell, CameraCell

ANY_OF_THEM = pytest.mark.parametrize(
    "cell",
    [
        pytest.param(CallbackCell, id="pin"),
        pytest.param(BeamCell, id="beams", marks=pytest.mark.soak),
        pytest.param(CameraCell, id="camera", marks=pytest.mark.soak),
    ],
    indirect=True,
)


class PcGone(BaseException):
    """The process of the server ends here."""


@pytest.fixture
def cell(tmp_path, request):
    made = getattr(request, "param", CallbackCell)(tmp_path)
    made.change_needle()
    yield made
    made.close()


def points_of(statements, chosen):
    """Return numbers of statements: the first time that each is reached."""
    first: dict[int, int] = {}
    for number, (file, line, text) in enumerate(statements):
        if file == "recal.prg" and chosen(text):
            first.setdefault(line, number)
    return sorted(first.values())


def cut_at_each(cell, chosen, *, least):
    points = points_of(cell.statements(), chosen)
    assert len(points) >= least
    ends = set()
    for point in points:
        cell.change_needle()
        old = cell.tool
        assert cell.run_until(point) is not None
        cell.restore()
        ends.add(cell.require_whole(old))
    cell.change_needle()
    assert cell.run() == ["kept"]
    assert cell.open_markers() == []
    assert cell.journal.verify().problems == ()
    return ends


@ANY_OF_THEM
def test_the_power_goes_before_a_statement_that_matters(cell):
    """Both ends must come up, or nothing was tried."""
    critical = ("rl_flag =", "TLSet n", "JUDGE", "KEPT,", "WROTE")
    ends = cut_at_each(cell, lambda text: any(word in text for word in critical), least=8)
    assert ends == {True, False}


@pytest.mark.soak
@ANY_OF_THEM
def test_the_power_goes_before_any_statement_of_the_companion(cell):
    assert cut_at_each(cell, lambda text: bool(text.strip()), least=80) == {True, False}


def test_an_old_value_is_put_back_once_and_no_later_start_touches_the_tool(cell):
    statements = cell.statements()
    flagged = [n for n, (_, _, text) in enumerate(statements) if text.strip() == "rl_flag = 1"]
    cell.change_needle()
    old = cell.tool
    # Well past the write: the proof is under way.
    cell.run_until(flagged[-1] + 200)
    assert cell.tool.rounded(3) != old.rounded(3)
    cell.restore()
    assert cell.tool.rounded(3) == old.rounded(3)
    cell.simulator.machine.tools.set(1, cell.simulator.world.tips[1])  # somebody else's
    cell.restore()
    assert cell.tool == cell.simulator.world.tips[1]


def commits_of(cell):
    """Run one change; return how often something is stored by a server thread."""
    count = 0

    def observer(point, _what):
        nonlocal count
        count += point is Checkpoint.COMMIT and in_server()

    with checkpoints.observed(observer):
        assert cell.run() == ["kept"]
    return count


def in_server():
    return threading.current_thread() is not threading.main_thread()


@ANY_OF_THEM
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_the_pc_goes_before_and_after_everything_that_it_stores(cell):
    total = commits_of(cell)
    assert total >= 10
    ends = set()
    for commit in range(total):
        cell.change_needle()
        old, at = cell.tool, -1

        def observer(point, _what, commit=commit):
            nonlocal at
            if point is Checkpoint.COMMIT and in_server():
                at += 1
                if at == commit:
                    raise PcGone

        with checkpoints.observed(observer):
            cell.run()
        cell.restart_server()
        # A process that is gone holds no lease; a thread that is gone leaves its process behind.
        log = cell.journal.log(IDENTITY)
        log.take_over("the PC was switched off")
        log.close()
        ends.add(cell.require_whole(old))
    assert ends == {True, False}
    cell.change_needle()
    assert cell.run() == ["kept"]
    assert cell.open_markers() == []
    assert cell.journal.verify().problems == ()
