"""What delivers pictures, and the errors by which it says why it does not."""

from typing import Final, Protocol

from robolink.eye.picture import CameraPicture

__all__ = ["CAMERA_CODES", "PictureSource"]

CAMERA_CODES: Final = (
    "camera_gone",
    "camera_taken",
    "packets_lost",
    "camera_refused",
    "picture_late",
    "picture_unreadable",
    "stale_picture",
    "picture_dark",
    "picture_overexposed",
)
"""Codes of :class:`~robolink.errors.CalibrationError` for a picture that cannot be used.

``camera_gone``: nothing answers, or the line broke; ``camera_taken``: another program has it;
``camera_refused``: it answers, and gives no picture: wrong path, user or password;
``packets_lost``: the frame is incomplete; ``picture_late``: none came in time;
``picture_unreadable``: what came is no picture; ``stale_picture``: it is older than the question;
``picture_dark`` and ``picture_overexposed``: nothing can be found in it.
"""


class PictureSource(Protocol):
    """One open camera, asked from one thread.

    ``close`` releases it for other programs and may be called twice.
    """

    @property
    def identity(self) -> str:
        """Which camera this is, for the record; without a user or a password."""

    @property
    def exposure_us(self) -> float | None:
        """Exposure time in microseconds, where the source can tell it."""

    def expose(self, exposure_us: float) -> None:
        """Set the exposure time; a source that cannot do so does nothing.

        Raises:
            CalibrationError: With one of :data:`CAMERA_CODES`.
        """

    def take(self) -> CameraPicture:
        """Return a picture whose exposure began after the call, as far as this source can know.

        Raises:
            CalibrationError: With one of :data:`CAMERA_CODES`.
        """

    def close(self) -> None:
        """Release it."""
