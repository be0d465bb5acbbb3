"""Pictures as the bytes of a file: PGM and PNG by hand, JPEG by Pillow where it is installed."""

import io
import struct
import zlib
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
import numpy.typing as npt

_PNG_START: Final = b"\x89PNG\r\n\x1a\n"
_JPEG_QUALITY: Final = 90


def pgm(grey: npt.NDArray[np.uint8]) -> bytes:
    """Return a picture as portable grey map (P5)."""
    height, width = grey.shape
    return b"P5\n%d %d\n255\n" % (width, height) + grey.tobytes()


def png(grey: npt.NDArray[np.uint8]) -> bytes:
    """Return a picture as PNG, 8 bits of grey without a filter (ISO/IEC 15948)."""
    height, width = grey.shape
    rows = np.zeros((height, width + 1), np.uint8)
    rows[:, 1:] = grey
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 1)), (b"IEND", b""))
    return _PNG_START + b"".join(_chunk(kind, data) for kind, data in parts)


def jpeg(grey: npt.NDArray[np.uint8]) -> bytes:
    """Return a picture as JPEG.

    Raises:
        ImportError: Pillow is not installed.
    """
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(grey).save(out, "JPEG", quality=_JPEG_QUALITY)
    return out.getvalue()


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


ENCODERS: Final[Mapping[str, tuple[str, Callable[[npt.NDArray[np.uint8]], bytes]]]] = {
    "pgm": ("image/x-portable-graymap", pgm),
    "png": ("image/png", png),
    "jpg": ("image/jpeg", jpeg),
}
"""By the ending of a file's name: its media type, and what encodes it."""
