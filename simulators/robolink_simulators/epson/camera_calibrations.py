"""Calibrations of cameras: those of Vision Guide, and those of VxCalib.

The calibration of a vision camera: from pixels to the robot's coordinates.

Source: docs/reference/vision.md 3.

Calibrations of cameras that are not Vision Guide's: VxCalib, VxTrans, VxCalInfo.

Source: docs/reference/vision.md 3.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.cell.camera import CameraTruth
from robolink_simulators.cell.places import Pixel
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point

__all__ = ["CameraMounting", "VisionCalibration"]

_FEWEST_POINTS = 3


class CameraMounting(IntEnum):
    """Where a camera is, as RC+ numbers it; one that rides on the robot is not simulated."""

    STANDALONE = 1
    FIXED_DOWNWARD = 2
    FIXED_UPWARD = 3


@dataclass(frozen=True, slots=True)
class VisionCalibration:
    """A linear map of the image onto the base.

    Attributes:
        mm_per_px: Matrix from pixels to mm of the base.
        origin_mm: Place of the base that pixel (0, 0) shows.
        mounting: Where the camera stands.
        complete: Whether all of its points have been taken.
    """

    mm_per_px: tuple[tuple[float, float], tuple[float, float]]
    origin_mm: tuple[float, float]
    mounting: CameraMounting = CameraMounting.FIXED_UPWARD
    complete: bool = True

    @classmethod
    def of_camera(cls, camera: CameraTruth) -> "VisionCalibration":
        """Return what a calibration without any error of its own would find."""
        width, height = camera.optics.size_px
        (a, b), (c, d) = matrix = camera.optics.mm_per_px
        x_mm, y_mm, _ = camera.middle_mm
        origin_mm = (x_mm - (a * width + b * height) / 2, y_mm - (c * width + d * height) / 2)
        return cls(matrix, origin_mm)

    @classmethod
    def of_points(
        cls, pixels: Sequence[Pixel], places_mm: Sequence[tuple[float, float]]
    ) -> "VisionCalibration":
        """Return the map that fits points best, as the nine points of RC+ (least squares).

        Args:
            pixels: Where each was seen.
            places_mm: X and Y of the robot there, with the tool that was in force.

        Raises:
            ConfigError: Fewer than three points, or all on one line.
        """
        if len(pixels) != len(places_mm) or len(pixels) < _FEWEST_POINTS:
            raise _unfit()
        px, py = (math.fsum(p[i] for p in pixels) / len(pixels) for i in (0, 1))
        x, y = (math.fsum(p[i] for p in places_mm) / len(places_mm) for i in (0, 1))
        rows = [(a - px, b - py) for a, b in pixels]
        aa, ab, bb = (math.fsum(r[i] * r[j] for r in rows) for i, j in ((0, 0), (0, 1), (1, 1)))
        area = aa * bb - ab * ab
        if area <= 1e-9 * aa * bb:
            raise _unfit()
        found = list[tuple[float, float]]()
        for axis, middle in enumerate((x, y)):
            wanted = [place[axis] - middle for place in places_mm]
            along, across = (
                math.fsum(r[i] * w for r, w in zip(rows, wanted, strict=True)) for i in (0, 1)
            )
            found.append(((bb * along - ab * across) / area, (aa * across - ab * along) / area))
        (a, b), (c, d) = found
        return cls(((a, b), (c, d)), (x - a * px - b * py, y - c * px - d * py))

    def camera_mm(self, pixel: Pixel) -> tuple[float, float]:
        """Return a place in the camera's frame, whose axes are the image's (assumed)."""
        (a, b), (c, d) = self.mm_per_px
        return pixel[0] * math.hypot(a, c), pixel[1] * math.hypot(b, d)

    def robot_mm(self, pixel: Pixel) -> tuple[float, float]:
        """Return a place in the base."""
        (a, b), (c, d) = self.mm_per_px
        x_mm, y_mm = self.origin_mm
        return x_mm + a * pixel[0] + b * pixel[1], y_mm + c * pixel[0] + d * pixel[1]

    def robot_deg(self, angle_deg: float) -> float:
        """Return how a direction of the image lies in the base, in degrees."""
        (a, b), (c, d) = self.mm_per_px
        along, across = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
        return math.degrees(math.atan2(c * along + d * across, a * along + b * across))


def _unfit() -> ConfigError:
    return ConfigError(
        tr("These points do not calibrate a camera."),
        remedy=tr("Give three places at least that are not on one line; RC+ takes nine."),
    )


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
