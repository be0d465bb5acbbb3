"""A stop beside a running robolink: who has the controller, and what a stop leaves behind.

``stop_now`` of :mod:`robolink.controllers` stops a controller that can be reached. Here is what
stands around it: the listener of a process that holds one, how a second terminal finds and asks
it, and the note by which the next command learns of the stop.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.stopping._asking import (
    ControllerHolder,
    HolderGoneError,
    LastSeen,
    holders_of,
)
from robolink.stopping._listener import StopListener
from robolink.stopping._notes import StopNote, clear_note, find_note, leave_note

__all__ = [
    "ControllerHolder",
    "HolderGoneError",
    "LastSeen",
    "StopListener",
    "StopNote",
    "clear_note",
    "find_note",
    "holders_of",
    "leave_note",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
