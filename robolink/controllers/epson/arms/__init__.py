"""The arms of EPSON robots: their documented figures, their joints, and how long they take."""

from robolink.controllers.epson.arms.times import EpsonTimes

__all__ = ["EpsonTimes"]
