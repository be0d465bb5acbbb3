"""A program killed anywhere: the value is old or tested, doubts are reported, recover ends them.

Each act is a row. Its program runs against a simulator of this process, once to its end and once up
to each of its instants, where it dies: before a request is carried out (which it is all the same),
before an answer leaves, and before and after each durable transaction of the journal; a
controller's own program dies before its statements. By default a sample is used: the transactions,
and the requests that log in or out, select, start or write; of a change ``make test`` uses a third
of them, and ``make soak`` the others too. ``ROBOLINK_ALL_KILL_POINTS=1`` uses all; ``pytest -s``
shows how many.

Four instants on each kind of line show that a real process dies like that: SIGKILL before and after
the write of a tool, and before and after the transaction that ends it is durable. There
acknowledged entries must be in the journal's file.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Final

import pytest

from tests.faults import _killed_calibrations as calibrations
from tests.faults import _killed_looks as looks
from tests.faults import _killed_orders as orders
from tests.faults import _killed_restores as restores
from tests.faults._callback_cell import CallbackCell
from tests.faults._callback_sensors import BeamCell, CameraCell, RoundCell
from tests.faults._change_cell import ChangeCell, EpsonChangeCell, Step, WireStep, change_cell
from tests.faults._change_process import NEW, OLD, CommitStep
from tests.faults._kill_points import (
    NOTHING_LEFT,
    check_killed_change,
    check_recovered,
    check_recovers,
)
from tests.faults._killed_callbacks import MortalCell, lose
from tests.faults._kills import kill
from tests.faults._mapped_change_cell import mapped_change_cell
from tests.faults._recipe_instants import EVERYTHING, Instant, Instants, noted
from tests.faults._softmotion_change_cell import plc_change_cell

pytestmark = pytest.mark.timeout(3600)

SOAK: Final = pytest.mark.soak
KINDS: Final[dict[str, Callable[[Path], AbstractContextManager[ChangeCell]]]] = {
    "EPSON": partial(change_cell, wire="sim"),
    "PLC": partial(plc_change_cell, wire="sim"),
    "register map": partial(mapped_change_cell, wire="sim"),
}
LINES: Final[dict[str, Callable[[Path], AbstractContextManager[ChangeCell]]]] = {
    "EPSON over TCP": partial(change_cell, wire="tcp"),
    "EPSON over RS232": partial(change_cell, wire="serial"),
    "PLC over Modbus TCP": partial(plc_change_cell, wire="modbus-tcp"),
    "PLC over Modbus RTU": partial(plc_change_cell, wire="modbus-rtu"),
    "PLC over CANopen": partial(plc_change_cell, wire="can-multicast"),
    "PLC over OPC UA": partial(plc_change_cell, wire="opcua"),
    "register map over Modbus TCP": partial(mapped_change_cell, wire="modbus-tcp"),
}


class Sample:
    """Chooses the instants at which a program dies: all, or, without the switch, a part.

    Args:
        matters: Whether an instant belongs to the sample.
        every: One in so many of those is used,
        first: beginning with this one.
    """

    def __init__(
        self, matters: Callable[[ChangeCell, Instant], bool], *, every: int = 1, first: int = 1
    ) -> None:
        self._matters = matters
        self._every = every
        self._first = first
        self._seen = 0

    def __call__(self, cell: ChangeCell, at: Instant) -> bool:
        """Whether the program dies there."""
        if at.kind not in ("request", "answer", "commit"):
            return False
        if EVERYTHING:
            return True
        self._seen += (matters := self._matters(cell, at))
        return matters and self._seen % self._every == self._first % self._every


def matters_to(cell: ChangeCell, at: Instant) -> bool:
    return at.kind == "commit" or cell.matters.match(at.what) is not None


World = Callable[[Path, Callable[[ChangeCell], object]], object]
"""Opens a cell in a folder, and does something there."""


def fresh(kind: str) -> World:
    def act(folder: Path, there: Callable[[ChangeCell], object]) -> None:
        with KINDS[kind](folder) as cell:
            there(cell)

    return act


def die(
    world: World,
    folder: Path,
    program: str,
    sample: Sample,
    check: Callable[[ChangeCell], object],
    *,
    whole: Callable[[ChangeCell], object],
) -> None:
    """Run a program, let it die at the instants of a sample, and check the leftovers.

    Args:
        world: Where a run begins.
        folder: The folder for those of the cells.
        program: The program.
        sample: Chooses the instants.
        check: The conditions after a death.
        whole: Those after the undisturbed run.
    """
    instants, dies_at = Instants(), list[Instant]()

    def run(cell: ChangeCell) -> None:
        cell.run(program, instants)
        dies_at.extend(at for at in instants.passed if sample(cell, at))
        whole(cell)

    world(folder / "whole", run)
    print(f"{program}: {len(dies_at)} kill points of {len(instants.passed)}")  # noqa: T201 - for pytest -s
    assert dies_at

    def death(at: Instant) -> Callable[[ChangeCell], None]:
        return lambda cell: kill(partial(cell.run, program), at, partial(check, cell))

    for number, at in enumerate(dies_at):
        world(folder / str(number), death(at))


PHASES: Final = {"EPSON": 1, "PLC": 2, "register map": 3}
"""A third of a sample: the kinds, whose transactions are the same, take its instants in turn."""


@pytest.mark.parametrize(
    ("kind", "program", "every"),
    [
        pytest.param("EPSON", "one tool", 1, marks=SOAK),
        pytest.param("EPSON", "two tools", 1, marks=SOAK),
        ("EPSON", "two tools, verified", 3),
        pytest.param("EPSON", "two tools, verified", 1, marks=SOAK),
        pytest.param("PLC", "one tool", 1, marks=SOAK),
        ("PLC", "two tools", 3),
        pytest.param("PLC", "two tools", 1, marks=SOAK),
        pytest.param("PLC", "two tools, verified", 1, marks=SOAK),
        pytest.param("register map", "one tool", 1, marks=SOAK),
        ("register map", "two tools", 3),
        pytest.param("register map", "two tools", 1, marks=SOAK),
    ],
)
@pytest.mark.fault("F57", "F58")
def test_f57_f58_a_change_killed_anywhere_is_recovered_as_a_whole(tmp_path, kind, program, every):
    def whole(cell: ChangeCell) -> None:
        assert cell.tools == (NEW if program != "one tool" else {**OLD, 1: NEW[1]})
        assert NOTHING_LEFT in cell.recover()

    sample = Sample(matters_to, every=every, first=PHASES[kind])
    check = partial(check_killed_change, program=program)
    die(fresh(kind), tmp_path, program, sample, check, whole=whole)


# The instants at which a change is killed, and then its recovery: before the first answer of the
# second kind after the first kind leaves. And the tools written by then.
WRITE_1, WRITE_2 = '$Execute,"TLSet 1,', '$Execute,"TLSet 2,'
LIST, LOOK = '$Execute,"TLSet"', "$GetStatus"
ON_PLC = "write_command WRITE_TOOL"
WRITES = (WRITE_1, ON_PLC, "fc16 100")
LEFT: Final[dict[str, tuple[str, str, str, str, list[int]]]] = {
    "a write whose answer was lost": ("EPSON", "one tool", WRITE_1, WRITE_1, [1]),
    "one tool of two": ("EPSON", "two tools", WRITE_1, LIST, [1]),
    "the second of two in doubt": ("EPSON", "two tools", WRITE_2, WRITE_2, [1, 2]),
    "two that nobody verified": ("EPSON", "two tools, verified", WRITE_2, LOOK, [1, 2]),
    "two, in doubt and not verified": ("EPSON", "two tools, verified", WRITE_2, WRITE_2, [1, 2]),
    "one slot of two": ("PLC", "two tools", ON_PLC, ON_PLC, [1]),
}
LEFT_USUALLY: Final = ("one tool of two", "two, in doubt and not verified", "one slot of two")
"""What ``make test`` begins with: a change half made, and the two doubts of a whole one at once."""


class Left:
    """Chooses one instant: the first answer of the second kind after the first kind."""

    def __init__(self, first: str, second: str) -> None:
        self._path = [first] if first == second else [first, second]

    def __call__(self, at: Instant) -> bool:
        """Whether this is it."""
        if not self._path or at.kind != "answer" or not at.what.startswith(self._path[0]):
            return False
        del self._path[0]
        return not self._path


@pytest.mark.parametrize(
    "left", [pytest.param(left, marks=() if left in LEFT_USUALLY else SOAK) for left in LEFT]
)
@pytest.mark.fault("F80")
def test_f80_a_recovery_killed_anywhere_may_be_run_again(tmp_path, left):
    kind, program, *path, expected = LEFT[left]
    instants = Instants()
    fresh(kind)(tmp_path / "undisturbed", lambda cell: cell.run(program, instants))
    at = next(filter(Left(*path), instants.passed))

    def world(folder: Path, there: Callable[[ChangeCell], object]) -> None:
        def left_there(cell: ChangeCell) -> None:
            cell.act()
            assert cell.writes() == expected
            there(cell)

        fresh(kind)(
            folder, lambda cell: kill(partial(cell.run, program), at, partial(left_there, cell))
        )

    def check(cell: ChangeCell) -> None:
        cell.act()
        check_recovers(cell, program, expected)

    def whole(cell: ChangeCell) -> None:
        check_recovered(cell, program, expected)

    die(world, tmp_path, "recover", Sample(matters_to, every=5), check, whole=whole)


@pytest.mark.parametrize("kind", ["EPSON", "PLC"])
@pytest.mark.parametrize(
    ("program", "whole"),
    [
        ("one tool, ordered", False),
        pytest.param("one tool, ordered", True, marks=SOAK),
        pytest.param("two tools, ordered", True, marks=SOAK),
    ],
)
@pytest.mark.fault("F79")
def test_f79_an_order_killed_anywhere_and_delivered_again_is_carried_out_once(
    tmp_path, kind, program, whole
):
    sample = Sample(lambda cell, at: whole or matters_to(cell, at), every=1 if whole else 4)
    check = partial(orders.check_killed_order, program=program)
    die(fresh(kind), tmp_path, program, sample, check, whole=ChangeCell.check_all_is_settled)


@pytest.mark.parametrize("kind", [pytest.param("EPSON", marks=SOAK), "PLC"])
@pytest.mark.fault("F57")
def test_f57_a_restore_killed_anywhere_keeps_what_is_done_and_is_ended_by_another(tmp_path, kind):
    def whole(cell: ChangeCell) -> None:
        assert restores.stage(cell) == restores.STAGES[-1]

    sample = Sample(matters_to, every=3)
    die(fresh(kind), tmp_path, "restore", sample, restores.check_killed_restore, whole=whole)


def test_a_look_killed_anywhere_is_never_taken_for_a_later_one(tmp_path):
    def world(folder: Path, there: Callable[[ChangeCell], object]) -> None:
        with change_cell(folder, wire="sim") as cell:
            looks.furnish(cell)
            there(cell)

    def whole(cell: ChangeCell) -> None:
        assert (cell.tools, cell.selected) == (OLD, 1)

    def check(cell: ChangeCell) -> None:
        assert isinstance(cell, EpsonChangeCell)
        looks.check_killed_look(cell)

    sample = Sample(lambda _cell, at: at.what.startswith("$Start"))
    die(world, tmp_path, "look", sample, check, whole=whole)


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(CallbackCell, id="pin"),
        pytest.param(BeamCell, id="beams", marks=SOAK),
        pytest.param(RoundCell, id="round", marks=SOAK),
        pytest.param(CameraCell, id="camera", marks=SOAK),
    ],
)
@pytest.mark.parametrize(
    ("gone", "everywhere"),
    [
        ("power", False),
        pytest.param("power", True, marks=SOAK),
        ("PC", False),
        pytest.param("PC", True, marks=SOAK),
    ],
)
@pytest.mark.fault("F57", "F58")
def test_f57_f58_a_change_by_the_controller_s_own_program_is_proved_or_was_never(
    tmp_path, kind, gone, everywhere
):
    begin = partial(MortalCell, kind, tmp_path)
    assert lose(begin, gone, everywhere=everywhere, refused=False) == {"old", "new"}


@pytest.mark.parametrize(
    ("gone", "everywhere"),
    [
        ("power", False),
        pytest.param("power", True, marks=SOAK),
        pytest.param("PC", True, marks=SOAK),
    ],
)
@pytest.mark.fault("F58")
def test_f58_a_value_that_was_refused_is_put_back_whatever_is_gone_meanwhile(
    tmp_path, gone, everywhere
):
    begin = partial(MortalCell, CallbackCell, tmp_path, refused=True)
    assert lose(begin, gone, everywhere=everywhere, refused=True) == {"old"}


CALIBRATION_SHARES: Final = 4 if EVERYTHING else 1
"""A whole run's instants are dealt to this many tests, so that workers can share them."""


@pytest.mark.parametrize("share", range(CALIBRATION_SHARES))
@pytest.mark.fault("F60")
def test_f60_a_calibration_killed_anywhere_leaves_the_old_or_the_new_value(share):
    calibrations.die(
        calibrations.words,
        calibrations.Dealt(share, shares=CALIBRATION_SHARES),
        lambda cell, _words: calibrations.check_killed(cell),
    )


ORDER_SHARES: Final = 16
"""The same for a whole ordered change; each takes about 14 s of CPU."""


def at_the_write(at: Instant) -> bool:
    return at.kind == "request" and at.what.startswith(WRITE_1)


@pytest.mark.parametrize(
    "dies",
    [
        pytest.param(at_the_write, id="at its write"),
        *(
            pytest.param(lambda at, share=share: at.number % ORDER_SHARES == share, marks=SOAK)
            for share in range(ORDER_SHARES)
        ),
    ],
)
@pytest.mark.fault("F79")
def test_f79_a_change_killed_anywhere_and_delivered_again_is_made_once(tmp_path, dies):
    calibrations.die(
        partial(orders.words, folder=tmp_path),
        lambda at: at.kind in ("request", "answer", "commit") and dies(at),
        orders.check_delivered_again,
    )


LEFT_TO_SOAK: Final = ("RTU", "CANopen", "OPC UA", "register map over Modbus TCP")


def four_of(steps: list[Step]) -> list[Step]:
    """Return the write of tool 1, before and after, and so the commit that ends the change."""
    wire = [s for s in steps if isinstance(s, WireStep) and s.request.startswith(WRITES)]
    durable = [step for step in steps if isinstance(step, CommitStep)]
    return [*wire[:2], *durable[-4:-2]]  # the last one gives the lease up


@pytest.mark.parametrize(
    "line",
    [pytest.param(name, marks=SOAK if name.endswith(LEFT_TO_SOAK) else ()) for name in LINES],
)
@pytest.mark.fault("F57", "F58")
def test_f57_f58_a_process_killed_at_four_instants_is_recovered_on_every_line(tmp_path, line):
    with LINES[line](tmp_path / "whole") as cell:
        steps = four_of(cell.steps_of("one tool"))
        assert cell.tools == {**OLD, 1: NEW[1]}
    assert len(steps) == 4
    for number, step in enumerate(steps):
        with LINES[line](tmp_path / str(number)) as cell, noted(step):
            cell.kill("one tool", step)
            check_killed_change(cell, "one tool")
