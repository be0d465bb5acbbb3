"""Statements that show how a controller prints; they change nothing and move nothing."""

from robolink.messages import tr
from robolink.protocols.spel._statements import LAST_TOOL, Statement, check_range


def print_plain_point() -> Statement:
    """A point that was given four coordinates.

    Source: docs/reference/epson.md 3.3: four or six are printed.
    """
    return Statement("Print XY(1, 2, 3, 4)")


def print_two_texts() -> Statement:
    """Two texts with a comma between (docs/reference/spel.md 3.2: a blank, or none)."""
    return Statement("Print Chr$(65), Chr$(66)")


def print_tool_x(tool: int) -> Statement:
    """One coordinate of a defined tool, without a format.

    Source: docs/reference/epson.md 3.3: how many digits.
    """
    check_range(tr("A tool that can be defined"), tool, 1, LAST_TOOL)
    return Statement(f"Print CX(TLSet({tool}))")


def wait_half_a_second() -> Statement:
    """Nothing, for half a second; legal in the command window (docs/reference/spel.md 4.6)."""
    return Statement("Wait 0.5")
