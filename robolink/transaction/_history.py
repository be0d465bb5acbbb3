"""What the record says about a tool: its last value, and how it was corrected before."""

import math
from dataclasses import dataclass

from robolink.messages import joined, tr
from robolink.model import (
    PROOFS,
    Controller,
    EntryKind,
    Recorded,
    ToolOffset,
    describe_offset,
    read_offset,
)
from robolink.timing import local_label


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
            at=local_label(self.at),
            recorded=describe_offset(self.recorded),
        )
        distance = self.distance_mm
        by = tr("That is {distance:.3f} mm away.", distance=distance) if distance else ""
        causes = tr(
            "The usual causes: a program that runs TLSet at its start, an edit on the pendant, a "
            "restored project."
        )
        return joined(" ", (part for part in (changed, by, causes) if part))


def last_proof(controller: Controller, tool: int) -> Recorded | None:
    """Return the newest entry that says what was read from ``tool`` after a write."""
    return next(
        (
            entry
            for entry in controller.outcomes.recorded(tool=tool, kinds=PROOFS)
            if "value" in entry.details
        ),
        None,
    )


def changed_since(controller: Controller, tool: int, now: ToolOffset | None) -> ChangedSince | None:
    """Compare a tool with what this software last proved to be in it.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        now: What it holds.

    Returns:
        ``None`` when it agrees, or was never written with this software.

    Example:
        >>> import robolink
        >>> from robolink.transaction import changed_since
        >>> with robolink.connect("epson+sim://since-example") as controller:
        ...     now = controller.tools.read(1)
        ...     print(changed_since(controller, 1, now))  # it was never written from here
        None
    """
    last = last_proof(controller, tool)
    if last is None:
        return None
    recorded = read_offset(last.details["value"])
    if controller.tools.same(recorded, now):
        return None
    return ChangedSince(tool, recorded, last.at, now)


def earlier_corrections(controller: Controller, tool: int) -> tuple[float, ...]:
    """Return the lengths, mm, of the corrections since the nozzle was mounted, oldest first.

    They are those in the plane: Z is often measured by another method, and a write of
    Z alone is none. A nozzle is known by the id
    that was given for it; without one nothing is known to be the same nozzle, and there is nothing
    to compare with. What was taken back is none.
    """
    nozzle = controller.outcomes.signature.nozzle
    lengths: list[float] = []
    taken_back: set[str] = set()
    if not nozzle:
        return ()
    kinds = (EntryKind.DONE, EntryKind.ROLLED_BACK)
    for entry in controller.outcomes.recorded(tool=tool, kinds=kinds):
        if entry.signature.nozzle != nozzle:
            break
        if entry.kind is EntryKind.ROLLED_BACK:
            taken_back.add(entry.change)
        if entry.change in taken_back:
            continue
        before = read_offset(entry.details.get("before"))
        value = read_offset(entry.details.get("value"))
        if before is None or value is None:
            break
        length_mm = math.hypot(value.x_mm - before.x_mm, value.y_mm - before.y_mm)
        if length_mm or value.z_mm == before.z_mm:  # a write of Z alone corrected no X and Y
            lengths.append(length_mm)
    return tuple(reversed(lengths))
