"""Streams of JPEG pictures over HTTP: multipart/x-mixed-replace."""

from contextlib import ExitStack, suppress
from http.client import HTTPResponse
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError
from robolink.eye.cameras.address import CameraAddress
from robolink.eye.cameras.decoding import MOST_BYTES, decoded, unreadable
from robolink.eye.cameras.http import ReadLimit, asked_for, reading
from robolink.messages import tr
from robolink.timing import Clock, SystemClock

if TYPE_CHECKING:
    from robolink.eye.cameras.stream import Frame
    from robolink.eye.picture import Grey

__all__ = ["MjpegReader"]

_LONGEST_LINE: Final = 65536
_MOST_HEADERS: Final = 64


class MjpegReader:
    """Implements :class:`~robolink.eye.cameras.stream.FrameReader` on an address of a stream.

    Args:
        url: ``http://`` or ``https://``.
        timeout_s: How long one frame may take.
        clock: What is waited on.

    Raises:
        ConfigError: It is no address.
        CalibrationError: As :meth:`robolink.eye.cameras.http.HttpSource.take`.
    """

    def __init__(self, url: str, *, timeout_s: float = 5.0, clock: Clock | None = None) -> None:
        self._address = CameraAddress.of(url)
        self._limit = ReadLimit(clock or SystemClock(), timeout_s)
        self._next = b""  # a line that was read too far
        self._open = ExitStack()
        self._answer: HTTPResponse = self._open.enter_context(asked_for(self._address, self._limit))
        try:
            self._boundary = self._announced()
        except BaseException:
            self._open.close()
            raise

    @property
    def identity(self) -> str:
        """The address, without user and password."""
        return self._address.shown

    @property
    def exposure_us(self) -> float | None:
        """Unknown: each maker has an address of its own for that."""
        return None

    def expose(self, exposure_us: float) -> None:
        """Do nothing: see :attr:`exposure_us`."""

    def read(self) -> "Frame":
        """Wait for the next frame; see :class:`~robolink.eye.cameras.stream.FrameReader`.

        Raises:
            CalibrationError: As :meth:`robolink.eye.cameras.http.HttpSource.take`.
        """
        self._limit.renew()
        with reading(self.identity, self._limit):
            data = self._part()
        name = self.identity

        def frame() -> "tuple[Grey, bytes]":
            return decoded(data, name), data

        return frame

    def interrupt(self) -> None:
        """Do nothing: a read ends with the time of a frame."""

    def close(self) -> None:
        """Close the connection."""
        with suppress(CalibrationError):
            self._open.close()

    def _announced(self) -> bytes:
        """Return what separates two pictures, without its dashes."""
        headers = self._answer.headers
        boundary = headers.get_param("boundary")
        if headers.get_content_maintype() != "multipart" or not isinstance(boundary, str):
            raise CalibrationError(
                "picture_unreadable",
                tr("{camera} delivers no stream of pictures.", camera=self.identity),
                remedy=tr("For the address of a single picture begin with http://."),
            )
        return boundary.encode("ascii", "replace").strip(b"-")

    def _part(self) -> bytes:
        """Read up to the end of the next picture."""
        length, read = None, 0
        while not self._separates(self._line()):
            read += 1
            if read > _MOST_HEADERS:
                raise unreadable(self.identity, cause=tr("its stream is damaged"))
        while line := self._line().strip():
            read += 1
            key, _, value = line.partition(b":")
            if key.lower() == b"content-length" and value.strip().isdigit():
                length = int(value)
            if read > 2 * _MOST_HEADERS or (length or 0) > MOST_BYTES:
                raise unreadable(self.identity, cause=tr("its stream is damaged"))
        if length is None:
            return self._up_to_the_next()
        data = self._answer.read(length)
        if len(data) < length:
            raise self._ended()
        return data

    def _up_to_the_next(self) -> bytes:
        """Read a picture whose length is not announced, with the line behind it."""
        data = bytearray()
        while not self._separates(line := self._line()):
            data += line
            if len(data) > MOST_BYTES:
                raise unreadable(self.identity, cause=tr("its stream is damaged"))
        self._next = line
        return bytes(data.removesuffix(b"\n").removesuffix(b"\r"))

    def _line(self) -> bytes:
        line, self._next = self._next or self._answer.readline(_LONGEST_LINE), b""
        if not line:
            raise self._ended()
        return line

    def _separates(self, line: bytes) -> bool:
        return line.startswith(b"--") and line.strip().strip(b"-") == self._boundary

    def _ended(self) -> CalibrationError:
        return CalibrationError(
            "camera_gone",
            tr("{camera} ended its stream.", camera=self.identity),
            remedy=tr("Check power, cable and address of the camera."),
        )
