"""What must be true whenever a tool change was killed, on every kind of controller."""

from robolink.model import ToolOffset
from tests.faults._change_cell import ChangeCell
from tests.faults._change_process import NEW, OLD

NOTHING_LEFT = "No job is left unfinished on this controller."


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


def check_killed_change(cell: ChangeCell, program: str) -> None:
    """Look at what a killed change left, recover twice, and look again."""
    cell.act()
    written = cell.writes()
    assert len(set(written)) == len(written)
    check_recovers(cell, program, written)


def check_recovers(cell: ChangeCell, program: str, written: list[int]) -> None:
    """Whatever was killed: what it left is told, and a recovery ends it."""
    cell.check_what_was_acknowledged_is_there()
    cell.check_the_selected_tool_is_right_or_named()
    cell.recover()
    assert NOTHING_LEFT in cell.recover()
    check_recovered(cell, program, written)
