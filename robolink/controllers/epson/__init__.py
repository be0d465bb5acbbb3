"""EPSON RC+ controllers: driver semantics on top of the Remote Ethernet codec."""

from robolink.controllers.epson._controller import EpsonController as EpsonController
from robolink.controllers.epson._open import open_epson as open_epson
from robolink.controllers.epson._published import PublishedTools as PublishedTools
from robolink.controllers.epson._setter import ValueReceipt as ValueReceipt
from robolink.controllers.epson._variables import EpsonVariables as EpsonVariables
from robolink.controllers.epson._variables import typed_value as typed_value
from robolink.controllers.epson._variables import variable_type as variable_type
from robolink.protocols.epson_text import VariableType as VariableType
