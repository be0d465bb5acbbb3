"""Codec + transport + semantics = a machine that can be used.

What another kind of controller is made of is offered here too (docs/extending.md).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.controller_core import ControllerCore as ControllerCore
    from robolink.controllers.driver_link import DriverLink as DriverLink
    from robolink.controllers.driver_link import MarkedCommand as MarkedCommand
    from robolink.controllers.driver_link import advise_emergency_stop as advise_emergency_stop
    from robolink.controllers.epson.controller import EpsonController as EpsonController
    from robolink.controllers.epson.controller import open_epson as open_epson
    from robolink.controllers.epson.io.variables import EpsonVariables as EpsonVariables
    from robolink.controllers.epson.io.variables import typed_value as typed_value
    from robolink.controllers.epson.io.variables import variable_type as variable_type
    from robolink.controllers.epson.tools.published import PublishedTools as PublishedTools
    from robolink.controllers.motion_group import MotionGroupCore as MotionGroupCore
    from robolink.controllers.plc_map.controller import PlcMapController as PlcMapController
    from robolink.controllers.plc_map.controller import open_plc_map as open_plc_map
    from robolink.controllers.plc_map.flange import FlangeReader as FlangeReader
    from robolink.controllers.polled_motion import PolledGroup as PolledGroup
    from robolink.controllers.preserving import Preserver as Preserver
    from robolink.controllers.reaching import connect_when_reachable as connect_when_reachable
    from robolink.controllers.registry import CONTROLLERS_GROUP as CONTROLLERS_GROUP
    from robolink.controllers.registry import ConnectionTerms as ConnectionTerms
    from robolink.controllers.registry import ControllerOpener as ControllerOpener
    from robolink.controllers.registry import capabilities_of_kind as capabilities_of_kind
    from robolink.controllers.registry import connect as connect
    from robolink.controllers.resolving import MarkerResolver as MarkerResolver
    from robolink.controllers.robot_models import axes_of_model as axes_of_model
    from robolink.controllers.softmotion.controller import (
        SoftMotionController as SoftMotionController,
    )
    from robolink.controllers.softmotion.controller import open_softmotion as open_softmotion
    from robolink.controllers.softmotion.facts import MailboxFacts as MailboxFacts
    from robolink.controllers.softmotion.link.device import read_device_id as read_device_id
    from robolink.controllers.softmotion.motion.jog import Jog as Jog
    from robolink.controllers.stopping import stop_now as stop_now
    from robolink.controllers.stopping import stop_requests as stop_requests
    from robolink.controllers.tool_table import ToolTableCore as ToolTableCore
    from robolink.controllers.tool_writing import ToolWrite as ToolWrite
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "controller_core": "ControllerCore",
            "driver_link": "DriverLink MarkedCommand advise_emergency_stop",
            "epson.controller": "EpsonController open_epson",
            "epson.io.variables": "EpsonVariables typed_value variable_type",
            "epson.tools.published": "PublishedTools",
            "motion_group": "MotionGroupCore",
            "plc_map.controller": "PlcMapController open_plc_map",
            "plc_map.flange": "FlangeReader",
            "polled_motion": "PolledGroup",
            "preserving": "Preserver",
            "reaching": "connect_when_reachable",
            "registry": (
                "CONTROLLERS_GROUP ConnectionTerms ControllerOpener capabilities_of_kind connect"
            ),
            "resolving": "MarkerResolver",
            "robot_models": "axes_of_model",
            "softmotion.controller": "SoftMotionController open_softmotion",
            "softmotion.facts": "MailboxFacts",
            "softmotion.link.device": "read_device_id",
            "softmotion.motion.jog": "Jog",
            "stopping": "stop_now stop_requests",
            "tool_table": "ToolTableCore",
            "tool_writing": "ToolWrite",
        },
    )
