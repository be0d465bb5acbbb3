"""What a line of the command line means to be true at its end, read past the program."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from robolink.model import ToolOffset

_UNITS: Final = {
    "--x": "x_mm",
    "--y": "y_mm",
    "--z": "z_mm",
    "--u": "u_deg",
    "--v": "v_deg",
    "--w": "w_deg",
}

STOP: Final = ("stop",)
"""The line that stops a machine, whoever moves it."""


def is_stop(line: Sequence[str]) -> bool:
    """Return whether a line stops the machine, and shows more than what it would send."""
    return tuple(line[:1]) == STOP and "--dry-run" not in line


def typed_components(line: Sequence[str]) -> tuple[int, dict[str, float]] | None:
    """Return which tool a line writes, and the components that it names; ``None`` for none."""
    if tuple(line[:2]) != ("tool", "set") or "--dry-run" in line or not line[2].isdigit():
        return None
    named = {_UNITS[one]: float(value) for one, value in pairwise(line) if one in _UNITS}
    return int(line[2]), named


def cleared(line: Sequence[str]) -> int | None:
    """Return which tool a line clears; ``None`` for none."""
    clears = tuple(line[:2]) == ("tool", "clear") and "--dry-run" not in line
    return int(line[2]) if clears else None


def selects(line: Sequence[str]) -> bool:
    """Whether another tool may be selected on purpose when a line has been carried out."""
    if line[:2] == ("tool", "select"):
        return True
    return "--then-select" in line or "--selected" in line


def offset_of(held: ToolOffset | None, named: Mapping[str, float]) -> ToolOffset:
    """Return what a tool is to hold when some of its components are typed."""
    return replace(held if held is not None else ToolOffset(), **named)
