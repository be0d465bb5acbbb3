"""Grey pictures as PNG files, small ones for pages. Needs numpy alone."""

import struct
import zlib
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["png_of", "shrunk"]

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"


def png_of(grey: "Grey", *, level: int = 6) -> bytes:
    """Return a grey picture as a PNG file of 8 bits a pixel (ISO/IEC 15948, filter 0).

    Args:
        grey: Rows by columns.
        level: How hard it is compressed, 1 to 9.
    """
    height, width = grey.shape
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    # Each row begins with the number of its filter; 0 is none.
    rows = b"".join(b"\0" + row.tobytes() for row in grey)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, level)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(name, data) for name, data in chunks)


def _chunk(name: bytes, data: bytes) -> bytes:
    checksum = zlib.crc32(name + data)
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", checksum)


def shrunk(grey: "Grey", most_px: int) -> "tuple[Grey, int]":
    """Return a picture of at most so many pixels a side, and by what it was divided.

    Each pixel is the mean of a square of them; what is left over at the right and below is
    cut off. A picture that is small enough stays as it is.

    Args:
        grey: Rows by columns.
        most_px: Longest side of the answer.
    """
    import numpy as np

    by = -(-max(grey.shape) // most_px)
    rows, columns = (side // by for side in grey.shape)
    if by == 1 or not rows or not columns:
        return grey, 1
    squares = grey[: rows * by, : columns * by].reshape(rows, by, columns, by)
    means: Grey = (squares.mean(axis=(1, 3), dtype=np.float32) + 0.5).astype(np.uint8)
    return means, by
