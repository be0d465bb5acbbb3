"""Cameras that see a tip: how one is opened by name, and how it is asked.

The cameras themselves are brought by other packages through the entry-point group
``robolink.sensors``; the simulated ones come through the same door.
"""

from robolink.sensing._asking import median_spot, scatter_of, seen_in, seen_once
from robolink.sensing._registry import SENSORS_GROUP, SensorOpener, open_sensor, sensor_name
from robolink.sensing._vision_guide import VISION_GUIDE, VisionGuideCamera

__all__ = [
    "SENSORS_GROUP",
    "SensorOpener",
    "VISION_GUIDE",
    "VisionGuideCamera",
    "median_spot",
    "open_sensor",
    "scatter_of",
    "seen_in",
    "seen_once",
    "sensor_name",
]
