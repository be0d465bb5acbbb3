"""EPSON RC+ controllers: driver semantics on top of the Remote Ethernet codec."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.protocols.epson_text import VariableType as VariableType

if TYPE_CHECKING:
    from robolink.controllers.epson._controller import EpsonController as EpsonController
    from robolink.controllers.epson._open import open_epson as open_epson
    from robolink.controllers.epson._published import PublishedTools as PublishedTools
    from robolink.controllers.epson._setter import ValueReceipt as ValueReceipt
    from robolink.controllers.epson._variables import EpsonVariables as EpsonVariables
    from robolink.controllers.epson._variables import typed_value as typed_value
    from robolink.controllers.epson._variables import variable_type as variable_type
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_controller": "EpsonController",
            "_open": "open_epson",
            "_published": "PublishedTools",
            "_setter": "ValueReceipt",
            "_variables": "EpsonVariables typed_value variable_type",
        },
    )
