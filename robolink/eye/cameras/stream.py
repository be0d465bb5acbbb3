"""Streams: pictures that come whether anybody asks or not."""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Protocol

from robolink import runtime
from robolink.errors import CalibrationError
from robolink.eye.picture import CameraPicture
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["Frame", "FrameReader", "StreamSource"]

Frame = Callable[[], "tuple[Grey, bytes]"]
"""A frame that has come: makes its pixels when they are wanted, and the bytes as they came."""

_SKIPPED: Final = 1
"""Frames that are skipped of those that begin after a question: the first may have been exposed
before, and waited in the camera."""

_ENDING_S: Final = 1.0
"""How much longer than a frame the end of the thread is waited for."""


class FrameReader(Protocol):
    """Reads one stream; called in one thread only, except :meth:`interrupt`."""

    @property
    def identity(self) -> str:
        """Which camera this is, without a user or a password."""

    @property
    def exposure_us(self) -> float | None:
        """Exposure time in microseconds, where it is known."""

    def expose(self, exposure_us: float) -> None:
        """Set the exposure time, where that is possible."""

    def read(self) -> Frame:
        """Wait for the next frame.

        Raises:
            CalibrationError: None comes any more.
        """

    def interrupt(self) -> None:
        """Let a read under way end soon, from another thread."""

    def close(self) -> None:
        """Release the camera."""


class StreamSource:
    """Implements :class:`~robolink.eye.source.PictureSource` on a stream.

    A thread reads all the time, so that nothing old waits in a buffer: unread for 2 s, OpenCV
    delivers pictures that are 2 s old (docs/reference/eye.md). A question is answered with a frame
    that began to arrive after it, and not with the first of those.

    Args:
        reader: Reads the frames; it is closed with the source.
        timeout_s: How long is waited for a frame.
        clock: What tells when frames came.
    """

    def __init__(
        self, reader: FrameReader, *, timeout_s: float = 5.0, clock: Clock | None = None
    ) -> None:
        self._reader = reader
        self._timeout_s = timeout_s
        self._clock = clock or SystemClock()
        self._room = runtime.waiting_room()
        self._question = 0
        self._skipped = 0
        self._number = 0
        self._answer: tuple[int, int, Frame] | None = None
        self._failure: CalibrationError | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robolink-stream", daemon=True)
        self._thread.start()

    @property
    def identity(self) -> str:
        """The camera."""
        return self._reader.identity

    @property
    def exposure_us(self) -> float | None:
        """As the camera tells it."""
        return self._reader.exposure_us

    def expose(self, exposure_us: float) -> None:
        """Set it, where the camera can do so."""
        self._reader.expose(exposure_us)

    def take(self) -> CameraPicture:
        """Wait for a frame; see :class:`~robolink.eye.source.PictureSource`.

        Raises:
            CalibrationError: ``camera_gone``: the stream ended; ``picture_late``: no frame came
                in time; ``picture_unreadable``.
        """
        import hashlib

        asked_ns = self._clock.now_ns()
        with self._room:
            self._question, self._skipped, self._answer = self._question + 1, 0, None
            came = self._room.wait_for(
                lambda: self._answer is not None or self._failure is not None, self._timeout_s
            )
            answer, failure = self._answer, self._failure
        if answer is None:
            raise self._late() if failure is None or not came else failure
        number, begun_ns, frame = answer
        grey, encoded = frame()
        return CameraPicture(
            grey=grey,
            asked_s=asked_ns / NS_PER_S,
            begun_s=begun_ns / NS_PER_S,
            digest=hashlib.sha256(encoded or grey.tobytes()).hexdigest(),
            name=f"{self.identity} {number}",
            encoded=encoded,
        )

    def close(self) -> None:
        """End the thread, which releases the camera."""
        self._ending.set()
        self._reader.interrupt()
        self._thread.join(self._timeout_s + _ENDING_S)

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                with self._room:
                    question = self._question  # the last one before this frame begins
                begun_ns = self._clock.now_ns()
                frame = self._reader.read()
                self._came(question, begun_ns, frame)
        except CalibrationError as error:
            self._failed(error)
        except Exception as error:  # whoever waits for a frame has to learn of it
            self._failed(self._gone(error))
        finally:
            self._reader.close()

    def _came(self, question: int, begun_ns: int, frame: Frame) -> None:
        with self._room:
            self._number += 1
            if not question or question != self._question or self._answer is not None:
                return
            if self._skipped < _SKIPPED:
                self._skipped += 1
                return
            self._answer = self._number, begun_ns, frame
            self._room.notify_all()

    def _failed(self, error: CalibrationError) -> None:
        with self._room:
            self._failure = error
            self._room.notify_all()

    def _gone(self, error: Exception) -> CalibrationError:
        return CalibrationError(
            "camera_gone",
            tr("The stream of {camera} ended: {cause}.", camera=self.identity, cause=error),
            remedy=tr("Check power and cable of the camera."),
        )

    def _late(self) -> CalibrationError:
        return CalibrationError(
            "picture_late",
            tr(
                "{camera} delivered no picture within {limit:g} s.",
                camera=self.identity,
                limit=self._timeout_s,
            ),
            remedy=tr("Check network and camera; a smaller picture is faster."),
        )
