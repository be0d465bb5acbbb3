"""Codec + transport + semantics = a machine that can be used."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.connection import connect as connect
    from robolink.controllers.driver_link import advise_emergency_stop as advise_emergency_stop
    from robolink.controllers.registry import CONTROLLERS_GROUP as CONTROLLERS_GROUP
    from robolink.controllers.registry import ConnectionTerms as ConnectionTerms
    from robolink.controllers.registry import ControllerOpener as ControllerOpener
    from robolink.controllers.stopping import stop_now as stop_now
    from robolink.controllers.stopping import stop_requests as stop_requests
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "connection": "connect",
            "driver_link": "advise_emergency_stop",
            "registry": "CONTROLLERS_GROUP ConnectionTerms ControllerOpener",
            "stopping": "stop_now stop_requests",
        },
    )
