"""Cameras that see a tip: how one is opened by name, and how it is asked.

The cameras themselves are brought by other packages through the entry-point group
``robolink.sensors``; the simulated ones come through the same door.
"""

from robolink.sensing._camera import (
    SENSORS_GROUP,
    VISION_GUIDE,
    SensorOpener,
    VisionGuideCamera,
    median_spot,
    open_sensor,
    scatter_of,
    seen_in,
    seen_once,
    sensor_name,
)

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
