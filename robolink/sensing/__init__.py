"""Cameras that see a tip: how one is opened by name, and how it is asked.

The cameras themselves are brought by other packages through the entry-point group
``robolink.sensors``; the simulated ones come through the same door.
"""

from robolink.sensing._asking import median_spot as median_spot
from robolink.sensing._asking import scatter_of as scatter_of
from robolink.sensing._asking import seen_in as seen_in
from robolink.sensing._asking import seen_once as seen_once
from robolink.sensing._registry import SENSORS_GROUP as SENSORS_GROUP
from robolink.sensing._registry import SensorOpener as SensorOpener
from robolink.sensing._registry import open_sensor as open_sensor
from robolink.sensing._registry import sensor_name as sensor_name
from robolink.sensing._vision_guide import VISION_GUIDE as VISION_GUIDE
from robolink.sensing._vision_guide import VisionGuideCamera as VisionGuideCamera
