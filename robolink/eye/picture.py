"""One picture of a camera, grey, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

__all__ = ["CameraPicture"]

if TYPE_CHECKING:
    Grey = npt.NDArray[np.uint8]
    """A grey picture: rows, columns; 0 is black."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraPicture:
    """One picture, as a source delivered it.

    Attributes:
        grey: Its pixels, rows by columns, 0 black to 255 white.
        asked_s: Reading of the monotonic clock when it was asked for.
        begun_s: The same when its exposure began, where the source knows; ``None`` where a server
            may have handed out what it had.
        digest: SHA-256 of the bytes as they came, hexadecimal: two exposures never share it.
        name: File, number of the frame or address, for a message and for the record.
        encoded: The bytes as they came, where they are a picture file; empty for raw frames.
    """

    grey: Grey
    asked_s: float
    begun_s: float | None = None
    digest: str = ""
    name: str = ""
    encoded: bytes = b""

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        height, width = self.grey.shape
        return width, height
