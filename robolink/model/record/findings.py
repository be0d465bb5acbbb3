"""What was found out about an open marker."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from robolink.model.record.journal_entries import NewEntry
from robolink.model.record.outcomes import Marker


class Verdict(StrEnum):
    """What reading the controller says about an open marker."""

    DONE = "done"
    NOT_APPLIED = "not applied"
    NOT_FINISHED = "not finished"
    CONFLICT = "conflict"
    LOOK = "look"
    NOT_RESTORED = "not restored"

    @property
    def needs_a_person(self) -> bool:
        """Whether reading the controller cannot settle it."""
        return self in (Verdict.CONFLICT, Verdict.LOOK)


@dataclass(frozen=True, slots=True)
class Finding:
    """An open marker and what is true now.

    Attributes:
        marker: What was begun.
        verdict: What became of it.
        sentence: The same for a person.
        action: What settling it will do beyond forgetting it, empty for nothing.
        entries: What settling it puts on record.
    """

    marker: Marker
    verdict: Verdict
    sentence: str
    action: str = ""
    entries: tuple[NewEntry, ...] = ()


class Resolver(Protocol):
    """Examines and settles what was begun on a controller and not proved finished."""

    def fence(self) -> None:
        """Make sure that nothing sent earlier, and not answered, takes effect from here on.

        What is read before may be overtaken by a request that arrives late; so whoever settles
        something calls this first. It changes nothing that a person would notice, and does
        nothing where a link cannot deliver late, or was fenced off in this session already.

        Raises:
            LeaseHeldError: Another client has the controller.
            RobolinkError: It cannot be done now; nothing may be settled.
        """

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; changes nothing.

        Raises:
            ConfigError: The marker was written by something else.
        """

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and forget the marker."""
