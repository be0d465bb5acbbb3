"""Codec + transport + semantics = a machine that can be used."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers._connect import connect as connect
    from robolink.controllers._stop_now import press_the_button as press_the_button
    from robolink.controllers._stop_now import stop_now as stop_now
    from robolink.controllers._stop_now import stop_requests as stop_requests
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_connect": "connect",
            "_stop_now": "press_the_button stop_now stop_requests",
        },
    )
