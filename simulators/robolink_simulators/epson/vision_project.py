"""A vision project, and a picture that it writes.

A vision project: sequences of objects, their properties, and the calibrations of cameras.

Source: docs/reference/vision.md 1, 2.

A picture as a file: grey, eight bits a pixel, in the BMP format.

Source of the format: Microsoft, BITMAPFILEHEADER and BITMAPINFOHEADER (wingdi.h). How a mark looks
is assumed: a dark disc about each tip, a dark square about each fiducial.
"""

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from robolink.model import TIP, Pose
from robolink_simulators.cell.places import Pixel
from robolink_simulators.epson.camera_calibrations import VisionCalibration
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

__all__ = ["PropertySet", "VisionObject", "VisionProject", "VisionSequence"]

VisionValue = bool | int | float | str
"""A value of a property or a result."""

SEQUENCE_PROPERTIES: Final[Mapping[str, VisionValue]] = {
    "calibration": "",
    "camera": 1,
    "camerabrightness": 128,
    "cameracontrast": 128,
    "exposuretime": 0,
    "runtimeacquire": 1,
}
"""Properties of a sequence by lower-case name, with their initial values."""

OBJECT_PROPERTIES: Final[Mapping[str, VisionValue]] = {
    "currentresult": 1,
    "numbertofind": 1,
    "robotuoffset": 0.0,
}
"""Properties of an object by lower-case name, with their initial values."""


class PropertySet:
    """Properties of a sequence or of an object.

    Args:
        owner: Whose they are, for messages.
        known: Those that there are, and what they are at first.
        given: Those that are otherwise.
    """

    def __init__(
        self, owner: str, known: Mapping[str, VisionValue], given: Mapping[str, VisionValue]
    ) -> None:
        self._owner = owner
        self._values = dict(known)
        for name, value in given.items():
            self.set(name.lower(), value)

    def holds(self, name: str) -> bool:
        """Return whether there is such a property."""
        return name in self._values

    def get(self, name: str) -> VisionValue:
        """Return what a property is.

        Raises:
            Refusal: There is none, or it is not simulated.
        """
        self._require(name)
        return self._values[name]

    def number(self, name: str) -> float:
        """Return a property that is a number."""
        return float(self.get(name))

    def set(self, name: str, value: VisionValue) -> None:
        """Change a property.

        Raises:
            Refusal: There is none, or it takes another kind of value.
        """
        self._require(name)
        if isinstance(self._values[name], str) is not isinstance(value, str):
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{self._owner}.{name} is of another kind")
        self._values[name] = value

    def _require(self, name: str) -> None:
        if name not in self._values:
            text = f"{self._owner} has no property or result {name}, or it is not simulated"
            raise SpelRefusal(RefusalKind.VISION_NAME, text)


class VisionObject:
    """Something that a sequence looks for.

    Args:
        name: Its name.
        mark: The tip, or the number of a fiducial; all fiducials look alike to it.
        properties: Those that are not as at first.
    """

    def __init__(
        self, name: str, mark: int = TIP, properties: Mapping[str, VisionValue] | None = None
    ) -> None:
        self.name = name
        self.mark = mark
        self.properties = PropertySet(name, OBJECT_PROPERTIES, properties or {})


class VisionSequence:
    """A sequence.

    Args:
        name: Its name.
        objects: What it looks for, in order.
        properties: Those that are not as at first.
    """

    def __init__(
        self,
        name: str,
        objects: Iterable[VisionObject],
        properties: Mapping[str, VisionValue] | None = None,
    ) -> None:
        self.name = name
        self.objects = {one.name.lower(): one for one in objects}
        self.properties = PropertySet(name, SEQUENCE_PROPERTIES, properties or {})

    def object(self, name: str) -> VisionObject:
        """Return one of its objects.

        Raises:
            Refusal: There is none of that name.
        """
        found = self.objects.get(name.lower())
        if found is None:
            text = f"Sequence {self.name} has no object {name}"
            raise SpelRefusal(RefusalKind.VISION_OBJECT, text)
        return found


@dataclass(slots=True)
class VisionProject:
    """What RC+ stores about vision beside the programs.

    Attributes:
        sequences: By their names in lower case.
        calibrations: By their names in lower case.
        taught: Poses of the robot at which VCal looks, by the name of a calibration.
    """

    sequences: dict[str, VisionSequence] = field(default_factory=dict)
    calibrations: dict[str, VisionCalibration] = field(default_factory=dict)
    taught: dict[str, tuple[Pose, ...]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, sequences: Iterable[VisionSequence], **calibrations: VisionCalibration
    ) -> "VisionProject":
        """Put a project together."""
        return cls(
            {one.name.lower(): one for one in sequences},
            {name.lower(): one for name, one in calibrations.items()},
        )

    def sequence(self, name: str) -> VisionSequence:
        """Return a sequence.

        Raises:
            Refusal: There is none of that name.
        """
        found = self.sequences.get(name.lower())
        if found is None:
            raise SpelRefusal(RefusalKind.VISION_SEQUENCE, f"There is no vision sequence {name}")
        return found


SUFFIX: Final = ".bmp"

_GROUND: Final = 200
_DARK: Final = 30
_RADIUS_PX: Final = 12
_HEADERS: Final = struct.Struct("<2sIHHI" + "IiiHHIIiiII")
_PALETTE: Final = b"".join(struct.pack("<BBBB", grey, grey, grey, 0) for grey in range(256))


def bitmap(size_px: tuple[int, int], tips: Iterable[Pixel], fiducials: Iterable[Pixel]) -> bytes:
    """Return the picture of what was seen as the content of a file.

    Args:
        size_px: Width and height.
        tips: Where tips are, from the upper left corner.
        fiducials: Where fiducials are.
    """
    width, height = size_px
    rows = [bytearray([_GROUND]) * width for _ in range(height)]
    for place, round_mark in [(tip, True) for tip in tips] + [(mark, False) for mark in fiducials]:
        _darken(rows, place, round_mark=round_mark)
    padding = bytes(-width % 4)
    data = b"".join(bytes(row) + padding for row in reversed(rows))
    offset = _HEADERS.size + len(_PALETTE)
    file = (b"BM", offset + len(data), 0, 0, offset)
    image = (40, width, height, 1, 8, 0, len(data), 2835, 2835, 256, 0)
    return _HEADERS.pack(*file, *image) + _PALETTE + data


def _darken(rows: list[bytearray], place: Pixel, *, round_mark: bool) -> None:
    x, y = (round(at) for at in place)
    for down in range(-_RADIUS_PX, _RADIUS_PX + 1):
        if not 0 <= y + down < len(rows):
            continue
        half = _RADIUS_PX
        if round_mark:
            half = int((_RADIUS_PX**2 - down**2) ** 0.5)
        row = rows[y + down]
        for at in range(max(0, x - half), min(len(row), x + half + 1)):
            row[at] = _DARK
