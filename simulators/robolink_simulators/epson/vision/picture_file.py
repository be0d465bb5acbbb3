"""A picture as a file: grey, eight bits a pixel, in the BMP format.

Source of the format: Microsoft, BITMAPFILEHEADER and BITMAPINFOHEADER (wingdi.h). How a mark looks
is assumed: a dark disc about each tip, a dark square about each fiducial.
"""

import struct
from collections.abc import Iterable
from typing import Final

from robolink_simulators.cell.places import Pixel

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
