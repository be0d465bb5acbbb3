"""Answers programs that calibrate at their own safe point (docs/spel-callback.md).

A SPEL+ program moves and writes; what is decided here is whether its measurement is believed, and
whether a value that it wrote is proved. For the program of a PLC, which moves, the value is
written from here (docs/plc-callback.md). Nothing moves from here.
"""

from robolink.serving._callback_limits import CallbackLimits
from robolink.serving._conversation import CallbackConversation
from robolink.serving._permits import PERMIT_METHODS, PermitCall, PermitPlan, free_machine
from robolink.serving._server import CallbackServer

__all__ = [
    "CallbackConversation",
    "CallbackLimits",
    "CallbackServer",
    "PERMIT_METHODS",
    "PermitCall",
    "PermitPlan",
    "free_machine",
]
