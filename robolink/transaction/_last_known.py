"""Whether a tool still holds what this software last proved to be in it."""

import math
from dataclasses import dataclass

from robolink.messages import tr
from robolink.model import ToolOffset, describe_offset


@dataclass(frozen=True, slots=True)
class ChangedSince:
    """A tool that somebody else changed.

    Attributes:
        tool: Its number.
        recorded: What was read back last.
        at: When, as a label.
        now: What it holds.
    """

    tool: int
    recorded: ToolOffset | None
    at: str
    now: ToolOffset | None

    @property
    def distance_mm(self) -> float | None:
        """How far the tip was moved, ``None`` where a value is undefined."""
        if self.recorded is None or self.now is None:
            return None
        return math.dist(self.recorded.components()[:3], self.now.components()[:3])

    @property
    def sentence(self) -> str:
        """When, by how much, and the usual causes."""
        changed = tr(
            "Tool {tool} holds {now}; on {at} it was left with {recorded}.",
            tool=self.tool,
            now=describe_offset(self.now),
            at=self.at,
            recorded=describe_offset(self.recorded),
        )
        distance = self.distance_mm
        by = tr("That is {distance:.3f} mm away.", distance=distance) if distance else ""
        causes = tr(
            "The usual causes: a program that runs TLSet at its start, an edit on the pendant, a "
            "restored project."
        )
        return " ".join(part for part in (changed, by, causes) if part)
