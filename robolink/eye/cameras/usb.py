"""Cameras on USB, and streams of other kinds, through OpenCV. Not tried with a real device."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import sensor_address

if TYPE_CHECKING:
    from robolink.eye.cameras.stream import Frame
    from robolink.eye.picture import Grey

__all__ = ["OpenCvReader"]

_MANUAL: Final = 1
"""Exposure mode of V4L2 in which the time counts (V4L2_EXPOSURE_MANUAL)."""

_V4L2_UNIT_US: Final = 100.0
"""Unit of V4L2_CID_EXPOSURE_ABSOLUTE."""


class OpenCvReader:
    """Implements :class:`~robolink.eye.cameras.stream.FrameReader` by ``cv2.VideoCapture``.

    Args:
        target: Number of a camera on USB, the path of its device, or the URL of a stream.
        timeout_s: How long opening and reading of a stream may take.

    Raises:
        ConfigError: OpenCV is missing.
        CalibrationError: ``camera_gone``; ``camera_taken``: its device is there and cannot be
            opened.
    """

    def __init__(self, target: int | str, *, timeout_s: float = 5.0) -> None:
        try:
            import cv2
        except ImportError as error:
            raise ConfigError(
                tr("Cameras on USB need the package OpenCV, which is missing."),
                remedy=tr("Install it: pip install 'robolink[eye-usb]'."),
            ) from error
        self._cv2: Any = cv2
        self._target = target
        self._capture = self._opened(timeout_s)

    @property
    def identity(self) -> str:
        """The camera, without a user or a password."""
        return f"usb {self._target}" if self._local else sensor_address(str(self._target))

    @property
    def exposure_us(self) -> float | None:
        """As V4L2 tells it; unknown elsewhere."""
        if not (self._local and sys.platform == "linux"):
            return None
        told = float(self._capture.get(self._cv2.CAP_PROP_EXPOSURE))
        return told * _V4L2_UNIT_US if told > 0 else None

    def expose(self, exposure_us: float) -> None:
        """Set it through V4L2; other systems have units of their own, and nothing is set."""
        if self._local and sys.platform == "linux":
            self._capture.set(self._cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
            self._capture.set(self._cv2.CAP_PROP_EXPOSURE, exposure_us / _V4L2_UNIT_US)

    def read(self) -> "Frame":
        """Wait for the next frame; see :class:`~robolink.eye.cameras.stream.FrameReader`.

        Raises:
            CalibrationError: ``camera_gone``.
        """
        there, colours = self._capture.read()
        if not there:
            raise self._gone()

        def frame() -> "tuple[Grey, bytes]":
            grey = colours
            if grey.ndim == 3:
                grey = self._cv2.cvtColor(colours, self._cv2.COLOR_BGR2GRAY)
            return cast("Grey", grey), b""

        return frame

    def interrupt(self) -> None:
        """Do nothing: a read ends with the next frame, or with its time."""

    def close(self) -> None:
        """Release the camera."""
        self._capture.release()

    @property
    def _local(self) -> bool:
        return isinstance(self._target, int) or self._target.startswith("/")

    def _opened(self, timeout_s: float) -> Any:  # noqa: ANN401 - OpenCV is optional
        if self._local:
            capture = self._cv2.VideoCapture(self._target)
        else:
            limit_ms = int(1000 * timeout_s)
            # Only FFmpeg: other ways print the address, with its password, when they fail.
            capture = self._cv2.VideoCapture(
                self._target,
                self._cv2.CAP_FFMPEG,
                [
                    *(self._cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms),
                    *(self._cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms),
                ],
            )
        if capture.isOpened():
            return capture
        capture.release()
        device = Path(f"/dev/video{self._target}" if isinstance(self._target, int) else "")
        if isinstance(self._target, int) and device.exists():
            raise CalibrationError(
                "camera_taken",
                tr("{device} is there and cannot be opened.", device=device),
                remedy=tr("Close other programs that use the camera; check who may read it."),
            )
        raise self._gone()

    def _gone(self) -> CalibrationError:
        return CalibrationError(
            "camera_gone",
            tr("{camera} delivers no pictures.", camera=self.identity),
            remedy=tr("Check its cable, and which cameras the system shows."),
        )
