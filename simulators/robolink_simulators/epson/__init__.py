"""A simulated EPSON SCARA controller with Remote Ethernet and a SPEL+ command window.

The names are loaded when they are first used: the device stands on the world, and the world
on parts of this package.
"""

from robolink_simulators.epson.condition import Mode
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers

__all__ = [
    "EpsonOptions",
    "EpsonSimulator",
    "Mode",
    "SpelNumbers",
]
