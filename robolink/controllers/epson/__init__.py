"""EPSON RC+ controllers: driver semantics on top of the Remote Ethernet codec."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.model import ValueReceipt as ValueReceipt
from robolink.protocols.epson_text import VariableType as VariableType

if TYPE_CHECKING:
    from robolink.controllers.epson.controller import EpsonController as EpsonController
    from robolink.controllers.epson.controller import open_epson as open_epson
    from robolink.controllers.epson.io.variables import EpsonVariables as EpsonVariables
    from robolink.controllers.epson.io.variables import typed_value as typed_value
    from robolink.controllers.epson.io.variables import variable_type as variable_type
    from robolink.controllers.epson.tools.published import PublishedTools as PublishedTools
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "controller": "EpsonController open_epson",
            "tools.published": "PublishedTools",
            "io.variables": "EpsonVariables typed_value variable_type",
        },
    )
