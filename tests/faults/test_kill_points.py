"""SIGKILL at each step of a nozzle change: nothing is written that was not asked, the next
command says that Tool 0 is still selected and names the old tool, and resolve puts it back.

A whole `robolink calibrate two-pose` runs as a process of its own against a served simulator.
Its process is killed at an exchange: before the controller carries it out, or after that and
before the answer leaves. By default a fixed sample is taken: every login, selection and write,
every third movement, and every 48th of the other exchanges. ``ROBOLINK_ALL_KILL_POINTS=1`` takes
all.
"""

import pytest

from robolink.journal import open_journal
from robolink.model import EntryKind
from tests.faults._nozzle_cell import OLD_TIP, NozzleCell, served_cell
from tests.faults._steps import SHARES, Step, disturbed, steps_of

pytestmark = pytest.mark.timeout(3600)


@pytest.fixture(scope="module")
def requests(tmp_path_factory):
    """What a nozzle change asks of the controller when nothing disturbs it."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        with served_cell(tmp_path_factory.mktemp("whole") / "cell", monkeypatch) as cell:
            client = cell.calibrate()
            assert client.exit_code() == 0, client.err
            cell.check_nothing_else_was_written()
            cell.check_settings_are_those_of_before()
            return cell.requests


def check(cell: NozzleCell, step: Step) -> None:
    disturbed(cell, step, lambda client: client.kill())
    cell.wait_at_rest()
    moves_started = cell.simulator.machine.arm.moves_started
    cell.check_nothing_else_was_written()
    assert cell.simulator.machine.flash_writes <= 1
    check_the_next_command_says_what_is_selected(cell)
    check_recover_puts_the_cell_s_own_tool_back(cell)
    assert cell.simulator.machine.arm.moves_started == moves_started
    check_motion_is_allowed_again(cell)


def check_the_next_command_says_what_is_selected(cell):
    markers = cell.open_markers()
    shown = cell.run("status")
    assert shown.code == 0, shown.err
    if cell.selected_tool != 1:
        assert "Tool 0 is selected now; it was tool 1 before" in shown.err
        assert "This puts tool 1 back, with the earlier power mode and speed" in shown.err
    assert shown.err.count(f'robolink -c "{cell.url}" recover') == len(markers)
    assert cell.open_markers() == markers


def check_recover_puts_the_cell_s_own_tool_back(cell):
    recovered = cell.run("recover", "--yes")
    assert recovered.code == 0, recovered.err
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()
    cell.check_nothing_else_was_written()
    kept = list(open_journal().log(cell.url).recorded(kinds=(EntryKind.DONE,)))
    assert (cell.tool_1 == OLD_TIP) is not bool(kept), "what nobody verified is taken back"


def check_motion_is_allowed_again(cell):
    moves_started = cell.simulator.machine.arm.moves_started
    for command in (("motors", "on", "--yes"), ("jog", "z+0.5", "--yes")):
        done = cell.run(*command)
        assert done.code == 0, done.err
    assert cell.simulator.machine.arm.moves_started == moves_started + 1


@pytest.mark.parametrize("share", range(SHARES))
@pytest.mark.fault("F60")
def test_f60_sigkill_at_each_step_leaves_the_old_or_the_new_value_and_resolve_ends_it(
    tmp_path, monkeypatch, requests, share
):
    steps = steps_of(requests, share)
    for step in steps:
        folder = tmp_path / f"{step.number}-{step.moment[:10]}"
        with served_cell(folder, monkeypatch) as cell:
            try:
                check(cell, step)
            except AssertionError as error:
                error.add_note(f"killed at {step}")
                raise
    print(f"{len(steps)} kill points of {2 * len(requests)}")  # noqa: T201 - for pytest -s
