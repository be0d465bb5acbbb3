"""EPSON RC+ controllers: driver semantics on top of the Remote Ethernet codec."""

from robolink.controllers.epson._controller import EpsonController as EpsonController
from robolink.controllers.epson._open import open_epson as open_epson
from robolink.controllers.epson._resolve import Finding as Finding
from robolink.controllers.epson._resolve import Verdict as Verdict
from robolink.controllers.epson._tools import describe as describe
