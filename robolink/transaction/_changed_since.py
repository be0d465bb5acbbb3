"""Whether a tool still holds what this software proved in it last."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from robolink.messages import joined, tr
from robolink.model import (
    PROOFS,
    Controller,
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
        return joined(" ", self.findings)

    @property
    def findings(self) -> tuple[str, ...]:
        """The same, a sentence each."""
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
        return tuple(part for part in (changed, by, causes) if part)


def last_proof(controller: Controller, tool: int) -> Recorded | None:
    """Return the newest entry with a value read from ``tool`` after a write."""
    return next(_proofs(controller.outcomes.recorded(tool=tool, kinds=PROOFS)), None)


def _proofs(entries: Iterable[Recorded]) -> Iterator[Recorded]:
    """Yield those with a value that was read from a tool after a write."""
    return (entry for entry in entries if entry.kind in PROOFS and "value" in entry.details)


def changed_since(controller: Controller, tool: int, now: ToolOffset | None) -> ChangedSince | None:
    """Compare a tool with the last value that this software confirmed in it.

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
    return _changed(controller, tool, now, last_proof(controller, tool))


def tools_changed_since(
    controller: Controller, tools: Mapping[int, ToolOffset | None], entries: Iterable[Recorded]
) -> Iterator[ChangedSince]:
    """Compare tools with the last values that this software confirmed in them.

    As :func:`changed_since`, for whoever has read the record of the controller already.

    Args:
        controller: The controller, connected.
        tools: What they hold, by their numbers.
        entries: Its entries of the kinds in :data:`robolink.model.PROOFS`, newest first; others
            may be among them.

    Example:
        >>> import robolink
        >>> from robolink.model import ToolOffset
        >>> from robolink.transaction import tools_changed_since
        >>> with robolink.connect("epson+sim://all-since-example") as controller:
        ...     receipt = controller.tools.write(2, ToolOffset(5, 6, -70), expected=None)
        ...     entries = list(controller.outcomes.recorded())
        ...     [one.tool for one in tools_changed_since(controller, {1: None, 2: None}, entries)]
        [2]
    """
    last: dict[int | None, Recorded] = {}
    for proof in _proofs(entries):
        last.setdefault(proof.tool, proof)
    changed = (_changed(controller, tool, now, last.get(tool)) for tool, now in tools.items())
    return (change for change in changed if change is not None)


def _changed(
    controller: Controller, tool: int, now: ToolOffset | None, last: Recorded | None
) -> ChangedSince | None:
    if last is None:
        return None
    recorded = read_offset(last.details["value"])
    if controller.tools.same(recorded, now):
        return None
    return ChangedSince(tool, recorded, last.at, now)
