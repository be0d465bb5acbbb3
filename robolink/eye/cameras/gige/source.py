"""Pictures of a GigE Vision camera, one at each question.

A picture is not older than the question, because the camera begins it at a command: a software
trigger, or where it has none the start of its acquisition. That nothing else begins pictures is
checked each time: a frame that nobody asked for ends the acquisition, and what it has sent goes
nowhere, since the next one has a port of its own.
"""

import ctypes
import hashlib
import socket
import threading
import time
from typing import Final

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.gige.aravis import DEVICE_ERRORS, Aravis, AravisError
from robolink.eye.cameras.gige.features import CameraFeatures
from robolink.eye.cameras.gige.gvcp import CONTROL, EXCLUSIVE, privilege
from robolink.eye.cameras.gige.pixel_formats import grey_pixels
from robolink.eye.cameras.gige.refusals import (
    camera_gone,
    camera_taken,
    packets_lost,
    unasked_pictures,
)
from robolink.eye.picture import CameraPicture
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock

__all__ = ["ACCESS_DENIED", "GigeSource", "PATIENCE_S"]

PATIENCE_S: Final = 5.0
"""How long a picture may take from its trigger, besides its exposure, in s."""

EXPOSURES: Final = 3
"""How often a picture is begun anew where packets of it are lost: its freshness does not suffer."""

_SLICE_US: Final = 50_000
"""How long Python waits inside the library before it looks for Ctrl-C."""

_BUFFERS: Final = 3
_NO_RAW_SOCKET: Final = 1
_RECEIVE_BYTES: Final = 4_194_304
_FRAME_RETENTION_US: Final = 100_000
"""How long the rest of a frame may be missing, besides the exposure."""

_SUCCESS: Final = 0
_IMAGE_PAYLOADS: Final = (1, 5)
_TIMEOUT: Final = 5
ACCESS_DENIED: Final = 17
_NO_ANSWERS: Final = (_TIMEOUT, 10, ACCESS_DENIED)
"""Numbers of ``ArvBufferStatus``, ``ArvBufferPayloadType`` and ``ArvDeviceError`` (10: this
program has the camera no longer).
"""


class GigeSource:
    """Implements :class:`~robolink.eye.source.PictureSource` on a GigE Vision camera.

    Args:
        library: The library.
        camera: The open camera, which is closed with this.
        device: The same, as the library's device.
        address: Its IPv4 address.
        patience_s: How long a picture may take from its trigger, besides its exposure.
        clock: What the times of a picture are read from.
    """

    def __init__(
        self,
        library: Aravis,
        camera: int,
        device: int,
        address: str,
        *,
        patience_s: float = PATIENCE_S,
        clock: Clock | None = None,
    ) -> None:
        self._library = library
        self._camera, self._device, self._address = camera, device, address
        self._patience_s = patience_s
        self._clock = clock or SystemClock()
        self._features = CameraFeatures(library, camera)
        self._stream: int | None = None
        self._triggered = False
        self._gone = self._closed = False
        self._label = address
        self._exposure_us: float | None = None

    def prepare(self) -> None:
        """Set the camera up so that pictures begin at a question.

        Raises:
            CalibrationError: ``camera_gone`` or ``camera_taken``.
        """
        try:
            self._label = self._named()
            self._triggered = self._features.trigger_by_software()
            self._features.one_at_a_time(triggered=self._triggered)
            if self._features.exposure_limits_us() is not None:
                self._exposure_us = self._features.exposure_us()
        except AravisError as error:
            raise self._lost(error) from error

    @property
    def identity(self) -> str:
        """Maker, model and serial number."""
        return f"gige {self._label}"

    @property
    def exposure_us(self) -> float | None:
        """Exposure time in microseconds; ``None`` for a camera that does not tell it."""
        return self._exposure_us

    def expose(self, exposure_us: float) -> None:
        """Set the exposure time; automatic exposure is switched off.

        Raises:
            ConfigError: The camera cannot expose for so long, or so briefly.
            CalibrationError: ``camera_gone`` or ``camera_taken``.
        """
        self._require_open()
        try:
            limits = self._features.exposure_limits_us()
            if limits is None:
                return
            if not limits[0] <= exposure_us <= limits[1]:
                raise ConfigError(
                    tr("The camera cannot expose for {exposure:g} us.", exposure=exposure_us),
                    remedy=tr(
                        "Use an exposure between {least:g} and {most:g} us.",
                        least=limits[0],
                        most=limits[1],
                    ),
                )
            self._end_stream()  # many cameras change it between pictures only
            self._features.set_exposure(exposure_us)
            self._exposure_us = self._features.exposure_us()
        except AravisError as error:
            raise self._lost(error) from error

    def take(self) -> CameraPicture:
        """Begin a picture and wait for it; see :class:`~robolink.eye.source.PictureSource`.

        Raises:
            CalibrationError: ``camera_gone``, ``camera_taken``, ``picture_late``,
                ``packets_lost``, ``picture_unreadable`` or ``stale_picture``.
        """
        self._require_open()
        asked_s = self._now_s()
        refused = packets_lost(EXPOSURES)
        try:
            for _ in range(EXPOSURES):
                taken = self._exposed(asked_s)
                if isinstance(taken, CameraPicture):
                    return taken
                refused = taken
        except AravisError as error:
            raise self._lost(error) from error
        except CalibrationError:
            self._end_stream()
            raise
        except BaseException:  # Ctrl-C: nobody asks this camera again
            self.close()
            raise
        self._end_stream()
        raise refused

    def close(self) -> None:
        """Put the camera's settings back and release it. Idempotent."""
        if self._closed:
            return
        self._closed = True
        self._end_stream()
        if not self._gone:
            self._features.put_back()
        self._release(self._camera, self._device)

    def _release(self, *held: int) -> None:
        def let_go() -> None:
            for one in held:
                self._library.let_go(one)

        if self._gone:
            # The library says good-bye to a camera that does not answer, for five seconds or more.
            threading.Thread(target=let_go, name="gige release", daemon=True).start()
        else:
            let_go()

    def _exposed(self, asked_s: float) -> CameraPicture | CalibrationError:
        """Return a picture, else why it has to be begun anew."""
        stream = self._running() if self._triggered else None
        if stream is not None and self._unasked(stream):
            self._end_stream()
            return unasked_pictures()
        begun_s, begun_wall_us = self._now_s(), time.time_ns() // 1000
        if stream is None:
            self._end_stream()
            stream = self._running()
        else:
            self._command("TriggerSoftware")
        buffer = self._arrived(stream)
        if buffer is None:
            raise self._no_picture()
        try:
            return self._read(buffer, (asked_s, begun_s), begun_wall_us)
        finally:
            if self._stream is None:
                self._library.let_go(buffer)
            else:
                self._library.call("arv_stream_push_buffer", self._stream, buffer)
            if not self._triggered:
                self._end_stream()

    def _read(
        self, buffer: int, times_s: tuple[float, float], begun_wall_us: int
    ) -> CameraPicture | CalibrationError:
        """Return what a buffer holds, else why it does not count."""
        call = self._library.call
        if call("arv_buffer_get_status", buffer) != _SUCCESS:
            return packets_lost(EXPOSURES)
        # The time at which its first packet came. It may be that of a picture that was on its way
        # when this one was asked for; both are this computer's, so they can be compared.
        if call("arv_buffer_get_system_timestamp", buffer) // 1000 < begun_wall_us:
            self._end_stream()
            return unasked_pictures()
        payload = call("arv_buffer_get_payload_type", buffer)
        if payload not in _IMAGE_PAYLOADS:
            raise CalibrationError(
                "picture_unreadable",
                tr(
                    "The camera sends something other than a plain image (payload type {type}).",
                    type=payload,
                ),
                remedy=tr("Switch off compression, chunks and multipart in the camera."),
            )
        size, padding = ctypes.c_size_t(), ctypes.c_int()
        start = call("arv_buffer_get_image_data", buffer, ctypes.byref(size))
        data = ctypes.string_at(start, size.value)
        call("arv_buffer_get_image_padding", buffer, ctypes.byref(padding), None)
        grey = grey_pixels(
            data,
            call("arv_buffer_get_image_pixel_format", buffer),
            (
                call("arv_buffer_get_image_width", buffer),
                call("arv_buffer_get_image_height", buffer),
            ),
            padding=padding.value,
        )
        asked_s, begun_s = times_s
        return CameraPicture(
            grey,
            asked_s=asked_s,
            begun_s=begun_s,
            digest=hashlib.sha256(data).hexdigest(),
            name=tr("frame {number}", number=call("arv_buffer_get_frame_id", buffer)),
        )

    def _running(self) -> int:
        """Return the stream; the camera's acquisition is on."""
        if self._stream is not None:
            return self._stream
        library = self._library
        if _may_receive(_RECEIVE_BYTES):
            # Without it the library reads raw packets where it may, which only root may: it is
            # left to where the system's buffer is too small for a picture.
            library.call("arv_gv_device_set_stream_options", self._device, _NO_RAW_SOCKET)
        stream = int(library.checked("arv_camera_create_stream", self._camera, None, None))
        self._stream = stream
        library.set_property(stream, "socket-buffer-size", _RECEIVE_BYTES)
        # Some cameras send the head of a frame when its exposure begins.
        retention_us = _FRAME_RETENTION_US + round(self._exposure_us or 0.0)
        library.set_property(stream, "frame-retention", retention_us)
        payload = library.checked("arv_camera_get_payload", self._camera)
        for _ in range(_BUFFERS):
            buffer = library.call("arv_buffer_new_allocate", payload)
            library.call("arv_stream_push_buffer", stream, buffer)
        self._command("AcquisitionStart")
        return stream

    def _end_stream(self) -> None:
        """End the acquisition; what is still on its way goes nowhere."""
        stream, self._stream = self._stream, None
        if stream is None:
            return
        try:
            if not self._gone:
                self._command("AcquisitionStop")
        except AravisError:
            self._gone = True
        finally:
            self._release(stream)

    def _command(self, name: str) -> None:
        self._library.checked("arv_camera_execute_command", self._camera, name.encode("ascii"))

    def _unasked(self, stream: int) -> bool:
        """Return whether pictures came that nobody asked for; they are thrown away."""
        found = False
        while buffer := self._library.call("arv_stream_try_pop_buffer", stream):
            found = True
            self._library.let_go(buffer)
        return found

    def _arrived(self, stream: int) -> int | None:
        """Wait for the next picture; ``None`` if none comes in time."""
        wait_us = self._patience_s * 1e6 + (self._exposure_us or 0.0)
        for _ in range(max(1, round(wait_us / _SLICE_US))):
            buffer = self._library.call("arv_stream_timeout_pop_buffer", stream, _SLICE_US)
            if buffer:
                return int(buffer)
        return None

    def _named(self) -> str:
        told = list[str]()
        for what in ("vendor_name", "model_name", "device_serial_number"):
            try:
                text = self._library.checked(f"arv_camera_get_{what}", self._camera)
            except AravisError as error:
                if error.domain == DEVICE_ERRORS and error.code == _TIMEOUT:
                    raise
                continue  # not every camera tells each of them
            told.append((text or b"").decode("utf-8", "replace").strip())
        return " ".join(filter(None, told)) or self._label

    def _now_s(self) -> float:
        return self._clock.now_ns() / NS_PER_S

    def _require_open(self) -> None:
        if self._closed or self._gone:
            raise camera_gone(self._label)

    def _no_picture(self) -> CalibrationError:
        """Return why no picture came although the camera was asked for one."""
        held = privilege(self._address)
        if held is None or not held & (CONTROL | EXCLUSIVE):
            self._gone = True
            return camera_gone(self._label)
        if not self._library.call("arv_gv_device_is_controller", self._device):
            self._gone = True
            return camera_taken(self._label)
        return CalibrationError(
            "picture_late",
            tr(
                "No picture of {camera} came within {limit:g} s.",
                camera=self._label,
                limit=self._patience_s + (self._exposure_us or 0.0) / 1e6,
            ),
            remedy=tr(
                "Check the camera's trigger and exposure settings, its network and its load."
            ),
        )

    def _lost(self, error: AravisError) -> CalibrationError | ConfigError:
        """Return what an error of the library means."""
        if error.domain != DEVICE_ERRORS or error.code not in _NO_ANSWERS:
            return ConfigError(
                tr(
                    "The camera {camera} refuses a setting that robolink needs: {cause}.",
                    camera=self._label,
                    cause=error,
                ),
                remedy=tr("Load the camera's factory settings, with its maker's program."),
            )
        self._gone = True
        self._end_stream()
        held = privilege(self._address)
        return camera_taken(self._label) if held else camera_gone(self._label)


def _may_receive(wanted: int) -> bool:
    """Return whether the system gives a socket that many bytes for what it has not read."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, wanted)
        return tried.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= wanted
