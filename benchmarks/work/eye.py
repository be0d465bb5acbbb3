"""The finder of tips against reading the same picture, a PNG, from memory.

The pictures are drawings of ``tests/eye`` of 1280 by 960 pixels; radii and kinds vary. Each pair is
timed in turn, in one thread, by the processor's time.
"""

import io
from collections.abc import Callable, Iterator
from statistics import median
from time import process_time_ns

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchmarks.table import Amount, Figure
from robolink.eye.candidate import TipShape
from robolink.eye.tip_finder import find_tips
from tests.eye.drawings import drawing

SIZE = (1280, 960)
SEEDS = (0, 5, 10, 18, 24, 26, 44, 50)
LARGE = (2592, 1944)
TIMES = 3
MOST = 5.5


def measure_eye() -> Iterator[Figure]:
    """Yield the figures of the finder."""
    ours, reading, teaching = [], [], []
    for seed in SEEDS:
        one = drawing(seed, SIZE)
        shape, kept = TipShape(one.radius_px * 1.03), _png(one.grey)
        for _ in range(TIMES):
            reading.append(_taken_ms(_read, kept))
            ours.append(_taken_ms(find_tips, one.grey, shape))
        teaching.append(_taken_ms(find_tips, one.grey, TipShape(None)))
    floor = Amount(median(reading), "ms")
    yield Figure(
        "a tip of known radius, 1280 x 960",
        Amount(median(ours), "ms"),
        "reading the same PNG",
        floor,
        median(ours) / floor.value,
        MOST,
    )
    yield Figure(
        "a tip of unknown radius, for teaching",
        Amount(median(teaching), "ms"),
        "reading the same PNG",
        floor,
        median(teaching) / floor.value,
    )
    large = drawing(SEEDS[0], LARGE)
    kept, shape = _png(large.grey), TipShape(large.radius_px)
    reading = [_taken_ms(_read, kept) for _ in range(TIMES)]
    ours = [_taken_ms(find_tips, large.grey, shape) for _ in range(TIMES)]
    yield Figure(
        "a tip of known radius, 2592 x 1944",
        Amount(median(ours), "ms"),
        "reading the same PNG",
        Amount(median(reading), "ms"),
        median(ours) / median(reading),
    )


def _png(grey: npt.NDArray[np.uint8]) -> bytes:
    kept = io.BytesIO()
    Image.fromarray(grey).save(kept, "PNG")
    return kept.getvalue()


def _read(kept: bytes) -> None:
    np.asarray(Image.open(io.BytesIO(kept)).convert("L"))


def _taken_ms(call: Callable[..., object], *given: object) -> float:
    began = process_time_ns()
    call(*given)
    return (process_time_ns() - began) / 1e6
