"""Controllers: codec, transport and semantics as a machine that can be used.

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
    from robolink.controllers.epson.tools import PublishedTools as PublishedTools
    from robolink.controllers.epson.values import EpsonVariables as EpsonVariables
    from robolink.controllers.epson.values import typed_value as typed_value
    from robolink.controllers.epson.values import variable_type as variable_type
    from robolink.controllers.model_axes import axes_of_model as axes_of_model
    from robolink.controllers.motion_group import MotionGroupCore as MotionGroupCore
    from robolink.controllers.motion_group import PolledGroup as PolledGroup
    from robolink.controllers.movement_time import AnswerCounts as AnswerCounts
    from robolink.controllers.movement_time import JointRates as JointRates
    from robolink.controllers.movement_time import MovementTimes as MovementTimes
    from robolink.controllers.movement_time import Way as Way
    from robolink.controllers.plc_map.browsing import browse_nodes as browse_nodes
    from robolink.controllers.plc_map.browsing import draft_from_nodes as draft_from_nodes
    from robolink.controllers.plc_map.controller import FlangeReader as FlangeReader
    from robolink.controllers.plc_map.controller import PlcMapController as PlcMapController
    from robolink.controllers.plc_map.controller import open_plc_map as open_plc_map
    from robolink.controllers.preserving import Preserver as Preserver
    from robolink.controllers.registry import CONTROLLERS_GROUP as CONTROLLERS_GROUP
    from robolink.controllers.registry import ConnectionTerms as ConnectionTerms
    from robolink.controllers.registry import ControllerOpener as ControllerOpener
    from robolink.controllers.registry import capabilities_of_kind as capabilities_of_kind
    from robolink.controllers.registry import connect as connect
    from robolink.controllers.registry import connect_when_reachable as connect_when_reachable
    from robolink.controllers.resolving import MarkerResolver as MarkerResolver
    from robolink.controllers.simple_controller import SimpleController as SimpleController
    from robolink.controllers.simple_controller import SimpleMachine as SimpleMachine
    from robolink.controllers.softmotion.controller import (
        SoftMotionController as SoftMotionController,
    )
    from robolink.controllers.softmotion.controller import open_softmotion as open_softmotion
    from robolink.controllers.softmotion.facts import MailboxFacts as MailboxFacts
    from robolink.controllers.softmotion.jog import Jog as Jog
    from robolink.controllers.softmotion.mailbox import read_device_id as read_device_id
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
            "epson.tools": "PublishedTools",
            "epson.values": "EpsonVariables typed_value variable_type",
            "motion_group": "MotionGroupCore PolledGroup",
            "movement_time": "AnswerCounts JointRates MovementTimes Way",
            "plc_map.browsing": "browse_nodes draft_from_nodes",
            "plc_map.controller": "FlangeReader PlcMapController open_plc_map",
            "preserving": "Preserver",
            "model_axes": "axes_of_model",
            "registry": (
                "CONTROLLERS_GROUP ConnectionTerms ControllerOpener "
                "capabilities_of_kind connect connect_when_reachable"
            ),
            "resolving": "MarkerResolver",
            "simple_controller": "SimpleController SimpleMachine",
            "softmotion.controller": "SoftMotionController open_softmotion",
            "softmotion.facts": "MailboxFacts",
            "softmotion.jog": "Jog",
            "softmotion.mailbox": "read_device_id",
            "stopping": "stop_now stop_requests",
            "tool_table": "ToolTableCore",
            "tool_writing": "ToolWrite",
        },
    )
