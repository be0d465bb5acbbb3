"""Answers programs that calibrate at their own safe point (docs/spel-callback.md).

A SPEL+ program moves and writes; what is decided here is whether its measurement is believed, and
whether a value that it wrote is proved. For the program of a PLC, which moves, the value is
written from here (docs/plc-callback.md). Nothing moves from here.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.serving._conversation import CallbackConversation as CallbackConversation
    from robolink.serving._judging import CallbackLimits as CallbackLimits
    from robolink.serving._permits import PERMIT_METHODS as PERMIT_METHODS
    from robolink.serving._permits import PermitCall as PermitCall
    from robolink.serving._permits import PermitPlan as PermitPlan
    from robolink.serving._permits import free_machine as free_machine
    from robolink.serving._server import CallbackServer as CallbackServer
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_conversation": "CallbackConversation",
            "_judging": "CallbackLimits",
            "_permits": "PERMIT_METHODS PermitCall PermitPlan free_machine",
            "_server": "CallbackServer",
        },
    )
