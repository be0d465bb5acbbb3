"""What was found out about an open marker."""

from dataclasses import dataclass
from enum import StrEnum

from robolink.model import Marker


class Verdict(StrEnum):
    """What reading the controller says about an open marker."""

    DONE = "done"
    NOT_APPLIED = "not applied"
    CONFLICT = "conflict"
    LOOK = "look"
    NOT_RESTORED = "not restored"


@dataclass(frozen=True, slots=True)
class Finding:
    """An open marker and what is true now.

    Attributes:
        marker: What was begun.
        verdict: What became of it.
        sentence: The same for a person.
        action: What settling it will do beyond forgetting it, empty for nothing.
    """

    marker: Marker
    verdict: Verdict
    sentence: str
    action: str = ""
