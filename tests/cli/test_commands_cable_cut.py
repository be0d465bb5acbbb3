"""Cable gone mid-move: a clear sentence, exit code 6, and the move is never sent again."""

import re

import pytest

from tests.faults._nozzle_cell import MOVE, NozzleCell, served_cell

TARGET = re.compile(r"XY\(([-\d.]+),")

pytestmark = pytest.mark.timeout(600)


def cut_during_move(cell: NozzleCell, nth: int) -> list[bool]:
    """Pull the cable at the first look at the status after the ``nth`` move was sent.

    What is returned tells afterwards whether the arm was moving then: the shortest jogs may
    have ended, and been answered, by that time.
    """
    moving: list[bool] = []

    def hold(_number: int, request: str) -> None:
        if cell.moves_requested == nth and request == "$GetStatus":
            cell.simulator.on_request = None
            cell.simulator.panel.cut_link()
            moving.append(cell.simulator.machine.arm.next_change() is not None)

    cell.simulator.on_request = hold
    return moving


def check(cell: NozzleCell, nth: int) -> bool:
    moving = cut_during_move(cell, nth)
    cut = cell.run(*cell.calibration)
    if moving == [True]:
        check_the_outcome_is_called_unknown(cut)
    else:
        written = cell.simulator.machine.flash_writes > 0
        check_the_link_is_called_broken(cut, code=6 if written else 3)
    cell.wait_at_rest()
    assert cell.moves_requested == nth
    assert cell.simulator.machine.arm.moves_started <= nth
    cell.check_nothing_else_was_written()
    if cell.simulator.machine.flash_writes:
        assert "Tool 1 may hold the new value, which was never tested" in cut.err
    check_the_next_command_says_what_is_left(cell, unknown=moving == [True])
    check_motion_is_blocked_until_recovered(cell)
    assert cell.moves_requested == nth + 1
    return moving == [True]


def check_the_outcome_is_called_unknown(cut):
    assert cut.code == 6, cut.err
    assert "may or may not have run" in cut.err
    assert "It was not sent again." in cut.err
    assert "'robolink recover'" in cut.err


def check_the_link_is_called_broken(cut, *, code):
    assert cut.code == code, cut.err
    assert "The previous tool, tool 1, could not be selected again" in cut.err
    assert "'robolink recover' selects it" in cut.err


def check_the_next_command_says_what_is_left(cell, *, unknown):
    shown = cell.run("status")
    assert shown.code == 0, shown.err
    (last,) = [text for text in cell.requests if MOVE.match(text)][-1:]
    (x_mm,) = TARGET.findall(last)
    begun = f"without a clear answer: a movement to X {x_mm}"
    assert (begun in shown.err) is unknown
    if cell.selected_tool == 0:
        assert "Tool 0 is selected now; it was tool 1 before" in shown.err


def check_motion_is_blocked_until_recovered(cell):
    for command in (("jog", "z+0.5", "--yes"), tuple(cell.calibration)):
        refused = cell.run(*command)
        assert refused.code == 6
        assert "'robolink recover'" in refused.err
    recovered = cell.run("recover", "--yes")
    assert recovered.code == 0, recovered.err
    cell.check_settings_are_those_of_before()
    assert cell.open_markers() == ()
    cell.check_nothing_else_was_written()
    moved = cell.run("jog", "z+0.5", "--yes")
    assert moved.code == 0, moved.err


@pytest.mark.parametrize(
    "every", [pytest.param(3, id="sample"), pytest.param(1, id="each", marks=pytest.mark.soak)]
)
def test_cable_gone_during_a_move_is_unknown_is_not_resent_and_is_settled_by_recover(
    tmp_path, monkeypatch, every
):
    with served_cell(tmp_path / "whole", monkeypatch) as cell:
        assert cell.run(*cell.calibration).code == 0
        moves = cell.moves_requested
    cut_while_moving = 0
    for nth in range(1, moves + 1, every):
        with served_cell(tmp_path / str(nth), monkeypatch, speed=50.0) as cell:
            try:
                cut_while_moving += check(cell, nth)
            except AssertionError as error:
                error.add_note(f"cut during move {nth} of {moves}")
                raise
    assert cut_while_moving >= 5 / every
