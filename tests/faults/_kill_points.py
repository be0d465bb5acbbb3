"""Conditions after a killed tool change, on every kind of controller."""

from robolink.model import ToolOffset
from tests.faults._change_cell import ChangeCell
from tests.faults._change_process import NEW, OLD

NOTHING_LEFT = "No job is left unfinished on this controller."


def right_values(program: str, cell: ChangeCell, written: list[int]) -> dict[int, ToolOffset]:
    """Return the required tool values after a recovery."""
    whole = len(written) == (1 if program == "one tool" else 2)
    kept = whole and (program != "two tools, verified" or cell.verified())
    return {tool: NEW[tool] if kept and tool in written else OLD[tool] for tool in OLD}


def check_recovered(cell: ChangeCell, program: str, written: list[int]) -> None:
    """A recovery leaves a whole change or none, with one write a tool at most."""
    right = right_values(program, cell, written)
    assert cell.tools == right
    put_back = cell.writes()[len(written) :]
    # One write restores one tool; a tool that is right already is not written.
    assert sorted(put_back) == [tool for tool in sorted(written) if right[tool] == OLD[tool]]
    cell.check_all_is_settled()


def check_killed_change(cell: ChangeCell, program: str) -> None:
    """Check the state after a killed change, recover twice, and check again."""
    cell.act()
    written = cell.writes()
    assert len(set(written)) == len(written)
    check_recovers(cell, program, written)


def check_recovers(cell: ChangeCell, program: str, written: list[int]) -> None:
    """Check that the leftovers of a killed program are reported, and that a recovery ends them."""
    cell.check_what_was_acknowledged_is_there()
    cell.check_the_selected_tool_is_right_or_named()
    cell.recover()
    assert NOTHING_LEFT in cell.recover()
    check_recovered(cell, program, written)
