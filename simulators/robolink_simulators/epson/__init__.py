"""A simulated EPSON SCARA controller with Remote Ethernet and a SPEL+ command window."""

from robolink_simulators.epson.condition import Mode as Mode
from robolink_simulators.epson.device import EpsonSimulator as EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions as EpsonOptions
from robolink_simulators.epson.options import SpelNumbers as SpelNumbers
