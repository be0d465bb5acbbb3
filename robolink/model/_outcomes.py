"""Durable markers of what was begun and not proved finished."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol


class MarkerKind(StrEnum):
    """What a marker stands for."""

    SET = "set"
    MOVE = "move"
    SELECTION = "selection"


@dataclass(frozen=True, slots=True)
class Marker:
    """One command or procedure that was begun.

    Attributes:
        operation: Unique id of the command.
        kind: ``SET`` a value is being written, ``MOVE`` the robot was told to move,
            ``SELECTION`` another tool than the cell's own is in force meanwhile.
        request: What was sent or begun, as a person may read it.
        begun_at: Wall-clock label, ISO 8601 UTC.
        details: Plain JSON values needed to settle it.
    """

    operation: str
    kind: MarkerKind
    request: str
    begun_at: str
    details: Mapping[str, object] = field(default_factory=dict)


class OutcomeLog(Protocol):
    """Keeps the markers of one controller, beyond the life of the process where it can."""

    def begin(self, marker: Marker) -> None:
        """Store ``marker``; it is durable when this returns.

        Raises:
            ConfigError: It cannot be stored. The command must not be sent then.
        """

    def clear(self, operation: str) -> None:
        """Forget the marker; unknown ids are ignored."""

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled, oldest first."""
