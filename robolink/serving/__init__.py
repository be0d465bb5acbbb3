"""Answers SPEL+ programs that measure and write a tool themselves (docs/spel-callback.md).

The program moves and writes; what is decided here is whether its measurement is believed, and
whether a value that it wrote is proved. Nothing is sent to a controller.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.serving._conversation import CallbackConversation as CallbackConversation
    from robolink.serving._judging import CallbackLimits as CallbackLimits
    from robolink.serving._server import CallbackServer as CallbackServer
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_conversation": "CallbackConversation",
            "_judging": "CallbackLimits",
            "_server": "CallbackServer",
        },
    )
