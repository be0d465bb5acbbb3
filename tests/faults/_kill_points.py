"""What must be true whenever a tool change was killed, on every kind of controller."""

import os

from robolink.model import ToolOffset
from tests.faults._change_cell import ChangeCell, Step
from tests.faults._change_process import NEW, OLD, CommitStep

NOTHING_LEFT = "Nothing is left unfinished on this controller."


def chosen(cell: ChangeCell, steps: list[Step], *, every: int = 1) -> list[Step]:
    """Return the steps at which to kill: all of them, or without the switch a sample.

    Args:
        cell: Where; it knows which exchanges matter.
        steps: All of them.
        every: Of what matters, one in so many makes the sample.
    """
    if os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1":
        return steps
    matters = [
        step for step in steps if isinstance(step, CommitStep) or cell.matters.match(step.request)
    ]
    return matters[::every]


def right_values(program: str, cell: ChangeCell, written: list[int]) -> dict[int, ToolOffset]:
    """Return what the tools must hold after a recovery."""
    whole = len(written) == (1 if program == "one tool" else 2)
    kept = whole and (program != "two tools, verified" or cell.verified())
    return {tool: NEW[tool] if kept and tool in written else OLD[tool] for tool in OLD}


def check_recovered(cell: ChangeCell, program: str, written: list[int]) -> None:
    """What a recovery left is a whole change or none, with one write a tool at most."""
    right = right_values(program, cell, written)
    assert cell.tools == right
    put_back = cell.writes()[len(written) :]
    # One write puts one tool back; a tool that is right already is not written.
    assert sorted(put_back) == [tool for tool in sorted(written) if right[tool] == OLD[tool]]
    cell.check_all_is_settled()


def check_killed_change(cell: ChangeCell, program: str, step: Step) -> None:
    """Kill a change at a step, look, recover twice, and look again."""
    cell.kill(program, step)
    written = cell.writes()
    assert len(set(written)) == len(written)
    cell.check_what_was_acknowledged_is_there()
    cell.check_the_selected_tool_is_right_or_named()
    cell.recover()
    assert NOTHING_LEFT in cell.recover()
    check_recovered(cell, program, written)
