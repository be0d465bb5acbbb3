"""Calibrations of cameras that are not Vision Guide's: VxCalib, VxTrans, VxCalInfo.

Source: docs/reference/vision.md 3.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.errors import ConfigError
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.vision.calibration import CameraMounting, VisionCalibration

_NUMBERS: Final = range(16)
_MOUNTINGS: Final = range(1, 8)
_INFORMATION: Final = range(1, 10)


@dataclass(frozen=True, slots=True)
class _Fitted:
    calibration: VisionCalibration
    errors_mm: tuple[tuple[float, float], ...]


class ImageCalibrations:
    """Calibrations 0 to 15 of a controller; a restart forgets them (VxCalSave is not simulated)."""

    def __init__(self) -> None:
        self._known: dict[int, _Fitted] = {}

    def define(
        self, number: int, mounting: int, pixels: Sequence[Point], places: Sequence[Point]
    ) -> None:
        """Carry VxCalib out.

        Args:
            number: 0 to 15.
            mounting: Where the camera stands, 1 to 7.
            pixels: X and Y are pixels.
            places: X and Y of the robot in mm, where each was seen.

        Raises:
            Refusal: A number is out of range, the camera rides on the robot (not simulated), or
                the points calibrate nothing.
        """
        if number not in _NUMBERS or mounting not in _MOUNTINGS:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"VxCalib {number}, {mounting}")
        if mounting > max(CameraMounting):
            raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A camera on the robot")
        seen = [_level(point) for point in pixels]
        there = [_level(point) for point in places]
        try:
            fitted = VisionCalibration.of_points(seen, there)
        except ConfigError as error:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, str(error)) from error
        found = [fitted.robot_mm(pixel) for pixel in seen]
        errors = tuple(
            (abs(a[0] - b[0]), abs(a[1] - b[1])) for a, b in zip(found, there, strict=True)
        )
        self._known[number] = _Fitted(fitted, errors)

    def robot_place(self, number: int, pixel: Point) -> Point:
        """Return the place of the robot that a pixel shows (VxTrans); Z and U are 0 (assumed).

        Raises:
            Refusal: There is no such calibration.
        """
        x_mm, y_mm = self._of(number).calibration.robot_mm(_level(pixel))
        return Point((x_mm, y_mm, 0.0, 0.0, 0.0, 0.0))

    def information(self, number: int, which: int) -> float:
        """Return VxCalInfo: 1 whether it is complete, then of X and of Y: mean error, greatest
        error (mm), mm per pixel, and tilt, which is 0 here: the map is linear.

        Raises:
            Refusal: There is no such information, or no such calibration to tell it of.
        """  # noqa: D205 - one sentence over two lines
        if which not in _INFORMATION or number not in _NUMBERS:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"VxCalInfo({number}, {which})")
        if which == 1:
            return int(number in self._known)
        fitted = self._of(number)
        axis, what = divmod(which - 2, 4)
        errors = [error[axis] for error in fitted.errors_mm]
        scale = math.hypot(*(row[axis] for row in fitted.calibration.mm_per_px))
        return (math.fsum(errors) / len(errors), max(errors), scale, 0.0)[what]

    def _of(self, number: int) -> _Fitted:
        if number not in self._known:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, f"There is no calibration {number}")
        return self._known[number]


def _level(point: Point) -> tuple[float, float]:
    return point.coordinates[0], point.coordinates[1]
