"""What every codec has in common."""

from enum import Enum, auto
from typing import Final


class Role(Enum):
    """The end of the line that a codec serves."""

    HOST = auto()
    DEVICE = auto()


class Need(Enum):
    """The one value of ``next_event`` that is not an event."""

    DATA = auto()


NEED_DATA: Final = Need.DATA
"""Returned by ``next_event`` when the bytes so far hold no further event."""
