"""What is before a GigE camera in tests: noise, and the time of its exposure."""

import struct
import time
from typing import Any

import numpy as np
from robolink_simulators.pictures.gige_camera import GigeFrame

SIZE_PX = (320, 240)
ADDRESS = "127.0.0.1"


class Scene:
    """What is before the camera: noise, and in its first pixels the time of its exposure.

    Attributes:
        frames: How the frames are sent, by their numbers from 1; those that are not named, well.
        size_px: Width and height.
    """

    def __init__(self, size_px: tuple[int, int] = SIZE_PX) -> None:
        self.frames = dict[int, dict[str, Any]]()
        self.size_px = size_px
        self.taken = 0
        self.last = np.zeros((1, 1), np.uint8)

    def __call__(self) -> GigeFrame:
        self.taken += 1
        width, height = self.size_px
        grey = np.random.default_rng(self.taken).integers(0, 256, (height, width), np.uint8)
        grey[0, :8] = np.frombuffer(struct.pack("<q", time.monotonic_ns()), np.uint8)
        self.last = grey
        return GigeFrame(grey, **self.frames.get(self.taken, {}))


def taken_at_s(grey: np.ndarray) -> float:
    """Return the time that stands in a picture."""
    taken_ns: int = struct.unpack("<q", grey[0, :8].tobytes())[0]
    return taken_ns / 1e9
