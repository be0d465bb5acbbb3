"""What a change of tools is to write."""

from collections.abc import Mapping
from dataclasses import dataclass

from robolink.model import Expected, ToolOffset


@dataclass(frozen=True, slots=True)
class Wanted:
    """What one tool is to hold.

    Attributes:
        tool: Its number.
        offset: The new value; ``None`` clears it.
        expected: What the caller believes it holds now.
        details: More for the journal, plain JSON.
        then_select: The tool to put in force before this one is cleared, should this one be in
            force; without it that is refused.
    """

    tool: int
    offset: ToolOffset | None
    expected: Expected
    details: Mapping[str, object] | None = None
    then_select: int | None = None
