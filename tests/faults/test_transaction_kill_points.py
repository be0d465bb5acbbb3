"""SIGKILL at each step of a tool write, of a change of two tools, and of ``recover`` itself.

A program is a process of its own against a served simulator. It is killed at an exchange,
before the controller carries it out (which it does all the same) or before its answer leaves,
or at a durable transaction of the journal, just before or just after it counts. Then
``robolink recover`` runs, and what is stored, selected and on record is looked at. By default
a sample is taken: every transaction, and the exchanges that log in or out, select or write; of
those of ``recover`` every fourth one.
``ROBOLINK_ALL_KILL_POINTS=1`` takes all. ``pytest -s`` shows how many.
"""

from itertools import dropwhile

import pytest

from tests.faults._change_cell import ChangeCell, Step, WireStep, change_cell
from tests.faults._change_process import NEW, OLD
from tests.faults._kill_points import (
    NOTHING_LEFT,
    check_killed_change,
    check_recovered,
    chosen,
)
from tests.faults._steps import MOMENTS

pytestmark = pytest.mark.timeout(3600)

CHANGES = (
    "one tool",
    pytest.param("two tools", marks=pytest.mark.soak),  # on a PLC in every run of the suite
    "two tools, verified",
)

# Where a change was killed, whose recovery is killed in turn: before the first answer of the
# second kind after the first kind leaves. And which tools were written by then.
WRITE_1, WRITE_2 = '$Execute,"TLSet 1,', '$Execute,"TLSet 2,'
LIST, LOOK = '$Execute,"TLSet"', "$GetStatus"
LEFT: dict[str, tuple[str, str, str, list[int]]] = {
    "a write whose answer was lost": ("one tool", WRITE_1, WRITE_1, [1]),
    "one tool of two": ("two tools", WRITE_1, LIST, [1]),
    "the second of two in doubt": ("two tools", WRITE_2, WRITE_2, [1, 2]),
    "two that nobody verified": ("two tools, verified", WRITE_2, LOOK, [1, 2]),
    "two, in doubt and not verified": ("two tools, verified", WRITE_2, WRITE_2, [1, 2]),
}


@pytest.mark.parametrize("program", CHANGES)
@pytest.mark.fault("F57", "F58")
def test_f57_f58_a_change_killed_at_each_step_is_recovered_as_a_whole(tmp_path, program):
    with change_cell(tmp_path / "whole") as cell:
        all_steps = cell.steps_of(program)
        right = {tool: NEW[tool] if tool in cell.writes() else OLD[tool] for tool in OLD}
        assert cell.tools == right
        assert NOTHING_LEFT in cell.recover()
    steps = chosen(cell, all_steps)
    for number, step in enumerate(steps):
        with change_cell(tmp_path / str(number)) as cell:
            try:
                check_killed_change(cell, program, step)
            except AssertionError as error:
                error.add_note(f"killed at {step}")
                raise
    print(f"{program}: {len(steps)} kill points of {len(all_steps)}")  # noqa: T201 - for pytest -s


def leave(cell: ChangeCell, left: str, all_steps: list[Step]) -> list[int]:
    """Kill a change where ``left`` says; return which tools were written until then."""
    program, *path, expected = LEFT[left]
    exchanges = [s for s in all_steps if isinstance(s, WireStep) and s.moment == MOMENTS[1]]
    for request in path:
        exchanges = list(dropwhile(lambda s: not s.request.startswith(request), exchanges))  # noqa: B023 - used at once
    cell.kill(program, exchanges[0])
    assert cell.writes() == expected
    return expected


def check_killed_recovery(cell: ChangeCell, left: str, all_steps: list[Step], step: Step) -> None:
    written = leave(cell, left, all_steps)
    cell.kill("recover", step)
    cell.check_what_was_acknowledged_is_there()
    cell.check_the_selected_tool_is_right_or_named()
    cell.recover()
    assert NOTHING_LEFT in cell.recover()
    check_recovered(cell, LEFT[left][0], written)


@pytest.mark.parametrize("left", LEFT)
@pytest.mark.fault("F80")
def test_f80_a_recovery_killed_at_each_step_may_be_run_again(tmp_path, left):
    program = LEFT[left][0]
    with change_cell(tmp_path / "change") as cell:
        change_steps = cell.steps_of(program)
    with change_cell(tmp_path / "whole") as cell:
        written = leave(cell, left, change_steps)
        all_steps = cell.steps_of("recover")
        check_recovered(cell, program, written)
    steps = chosen(cell, all_steps, every=4)
    for number, step in enumerate(steps):
        with change_cell(tmp_path / str(number)) as cell:
            try:
                check_killed_recovery(cell, left, change_steps, step)
            except AssertionError as error:
                error.add_note(f"recovery killed at {step}")
                raise
    print(f"recover, {left}: {len(steps)} kill points of {len(all_steps)}")  # noqa: T201 - for pytest -s
