"""Who a controller is, whatever the URL by which it was reached."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Identity:
    """Who a controller is, as far as it told.

    Journal, markers, leases, backups and undo hang on the name, so it must not depend on how
    an address is spelled, on the medium, or on the name of a serial port.

    Attributes:
        name: The name under which everything is on record.
        address: How it was reached this time: the URL, with those options only that tell far
            ends apart.
        place: The name that it has where it says nothing of itself: its resolved address.
        certain: Whether asking once more would tell the same. A controller that is busy may
            be unable to answer just now.
    """

    name: str
    address: str
    place: str
    certain: bool = True

    @property
    def own(self) -> bool:
        """Whether the name rests on what the controller said of itself."""
        return self.name != self.place


def is_own_name(name: str) -> bool:
    """Tell a name that rests on what a controller said of itself from an address.

    ``softmotion:0A1B2C3D`` is one; ``softmotion@192.168.0.2:502`` and URLs are not.
    """
    kind, _, number = name.partition(":")
    return bool(number) and kind.isalpha()


Who: TypeAlias = Callable[[], Identity]
"""Asks a controller who it is; raises what any exchange with it may raise."""
