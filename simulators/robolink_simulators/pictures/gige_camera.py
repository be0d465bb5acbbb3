"""Serves pictures as a GigE Vision camera does, with the fake camera of the library Aravis.

The protocol on the wire is that of the library, the pictures are those of the simulated cell. It
listens on the port of GigE Vision, which cannot be chosen, so there is one on each address of this
computer. Beyond what the fake camera does by itself, it loses packets, is slow, falls silent,
belongs to another program or sends pictures that nobody asked for.

What it does otherwise than a real camera: it refuses another program by silence, it never sends a
lost packet again, and it sends as fast as the computer can, which a receive buffer must hold.
"""

import ctypes
import ipaddress
import os
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from errno import EADDRINUSE, EADDRNOTAVAIL
from itertools import count
from socket import AF_INET, SOCK_DGRAM, socket
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, ConnectError
from robolink.eye.cameras.gige.aravis import FillPattern, aravis
from robolink.eye.cameras.gige.gvcp import (
    CONTROL,
    GVCP_PORT,
    HEARTBEAT_MS_REGISTER,
    PRIVILEGE_REGISTER,
    gvcp_channel,
)
from robolink.interrupts import ClosedAtExit
from robolink.messages import tr
from robolink_simulators.hosting.addresses import cannot_listen, require_loopback
from robolink_simulators.pictures.camera import DrawnCamera

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

__all__ = ["GigeCamera", "GigeFrame", "drawn_gige_camera", "fake_description"]

NOMINAL_EXPOSURE_US: Final = 10_000
"""Exposure time with which pictures are as bright as they are drawn; the fake camera's own."""

SILENT_S: Final = 30.0
"""How long a camera is silent that answers nothing, unless it is closed before."""

_WIDTH: Final = 0x100
_HEIGHT: Final = 0x104
_SENSOR_HEIGHT: Final = 0x118
_SENSOR_WIDTH: Final = 0x11C
_ACQUISITION: Final = 0x124
_TRIGGER_MODE: Final = 0x300
_TRIGGER_NOW: Final = 0x30C
_STREAM_PORT: Final = 0xD00
_PACKET_SIZE: Final = 0xD04
_SCRATCH: Final = 0x1F0
"""Registers of the fake camera (arvfakecamera.h of Aravis 0.8.26)."""

PACKET_BYTES: Final = 8_000
"""Fewer and larger packets than on a real network take a third of the time on loopback."""

_TRIGGERS_PER_S: Final = 250.0
"""How often the fake camera looks for a trigger."""

_HALVED: Final = 0.5
"""Share of the packets that are lost of a picture of which half is delivered."""

_NOTE_PERIOD_S: Final = 0.02
_HEARTBEAT_MS: Final = 10_000
"""Real cameras have 3 s as a rule. This one hears nothing while a picture is drawn, which may take
long on a busy computer.
"""

_FOR_GOOD_MS: Final = 0xFFFFFFFF
_serials = count(1)


@dataclass(frozen=True, slots=True, eq=False)
class GigeFrame:
    """One picture, and how it is sent.

    Attributes:
        grey: Its pixels, rows by columns.
        lost: Share of its packets that are lost on the way.
        slow_s: How long after its exposure it is sent.
        silent: Whether the camera falls silent instead of sending it.
    """

    grey: "npt.NDArray[np.uint8]"
    lost: float = 0.0
    slow_s: float = 0.0
    silent: bool = False


class GigeCamera(ClosedAtExit):
    """A camera on loopback, until it is closed.

    Args:
        exposed: Returns the picture of the moment at which it is called.
        size_px: Width and height of all pictures.
        address: Where it listens; an address of an interface of this computer.
        serial: Its serial number, at most 15 letters; drawn when it is left out.
        description: File with another description of what the camera can do (GenICam XML).
        packet_bytes: Size of its packets.
        note: Called 50 times a second while it is open.

    Attributes:
        frames: How many pictures it took.
        failed: What ``exposed`` raised last, ``None`` for nothing; that picture was not sent.

    Raises:
        ConfigError: The library is missing, or the address is not loopback.
        ConnectError: The port is taken, or the address is not this computer's.

    Example:
        >>> import numpy as np
        >>> def picture():
        ...     return GigeFrame(np.zeros((480, 640), np.uint8))
        >>> with GigeCamera(picture, (640, 480)) as camera:  # doctest: +SKIP
        ...     camera.url
        'gige://127.0.0.1'
    """

    def __init__(
        self,
        exposed: Callable[[], GigeFrame],
        size_px: tuple[int, int],
        *,
        address: str = "127.0.0.1",
        serial: str = "",
        description: str | None = None,
        packet_bytes: int = PACKET_BYTES,
        note: Callable[[], None] | None = None,
    ) -> None:
        _require_address(address)
        self._library = aravis()
        self._exposed, self._size_px = exposed, size_px
        self._ends, self._open = threading.Event(), threading.Lock()
        self._late: GigeFrame | None = None
        self._timers = list[threading.Timer]()
        self._filled = FillPattern(self._fill)  # the library keeps its address only
        self.frames = 0
        self.failed: BaseException | None = None
        self.address, self.serial = address, serial or f"SIM-{next(_serials)}"
        _require_free(address)
        xml = None if description is None else description.encode()
        self._camera: int | None = self._library.call(
            "arv_gv_fake_camera_new_full", address.encode("ascii"), self.serial.encode("ascii"), xml
        )
        self._fake = self._library.call("arv_gv_fake_camera_get_fake_camera", self._camera)
        for register, value in (
            (HEARTBEAT_MS_REGISTER, _HEARTBEAT_MS),
            *((_SENSOR_WIDTH, size_px[0]), (_SENSOR_HEIGHT, size_px[1])),
            *((_WIDTH, size_px[0]), (_HEIGHT, size_px[1]), (_PACKET_SIZE, packet_bytes)),
        ):
            self.write_register(register, value)
        self._library.call("arv_fake_camera_set_trigger_frequency", self._fake, _TRIGGERS_PER_S)
        self._library.call("arv_fake_camera_set_fill_pattern", self._fake, self._filled, None)
        self._require_listening()
        if note is not None:
            threading.Thread(
                target=self._regularly, args=(note,), name="gige places", daemon=True
            ).start()

    @property
    def url(self) -> str:
        """By which robolink opens it."""
        return f"gige://{self.address}"

    def document(self) -> dict[str, object]:
        """Return where pictures are to be had, ready for JSON."""
        return {"url": self.url, "urls": {"gige": self.url}, "size_px": list(self._size_px)}

    def write_register(self, register: int, value: int) -> None:
        """Write a register from inside, as the camera's own firmware would, while it is open."""
        with self._open:
            if self._camera is not None:
                self._library.call("arv_fake_camera_write_register", self._fake, register, value)

    def read_register(self, register: int) -> int:
        """Read a register from inside; 0 when it is closed."""
        value = ctypes.c_uint32()
        with self._open:
            if self._camera is not None:
                self._library.call(
                    "arv_fake_camera_read_register", self._fake, register, ctypes.byref(value)
                )
        return value.value

    def ignore_triggers(self) -> None:
        """Send pictures from now on as they come, 25 a second, whatever is asked for."""
        self.write_register(_TRIGGER_MODE, 0)

    @contextmanager
    def held_by_another(self) -> Iterator[None]:
        """Belong to another program for a block.

        Raises:
            ConnectError: It belongs to somebody already.
        """
        with gvcp_channel(self.address) as channel:
            self.write_register(HEARTBEAT_MS_REGISTER, _FOR_GOOD_MS)
            taken = channel.read(PRIVILEGE_REGISTER) == 0
            if not (taken and channel.write(PRIVILEGE_REGISTER, CONTROL)):
                raise ConnectError(tr("Another program is using the simulated camera."))
            try:
                yield
            finally:
                channel.write(PRIVILEGE_REGISTER, 0)
                self.write_register(HEARTBEAT_MS_REGISTER, _HEARTBEAT_MS)

    def close(self) -> None:
        """Answer nothing any more. Idempotent."""
        with self._open:
            camera, self._camera = self._camera, None
        self._ends.set()
        for timer in self._timers:
            timer.cancel()
        self._library.let_go(camera)  # waits for its thread

    def _regularly(self, note: Callable[[], None]) -> None:
        while not self._ends.wait(_NOTE_PERIOD_S):
            note()

    def _next(self) -> GigeFrame:
        self.frames += 1
        return self._exposed()

    def _later(self, frame: GigeFrame) -> None:
        port = self.read_register(_STREAM_PORT)
        timer = threading.Timer(frame.slow_s, self._deliver, (frame, port))
        timer.daemon = True
        self._timers = [*(one for one in self._timers if one.is_alive()), timer]
        timer.start()

    def _deliver(self, frame: GigeFrame, port: int) -> None:
        """Send a picture that was slow, unless its acquisition has ended meanwhile."""
        if self.read_register(_ACQUISITION) and self.read_register(_STREAM_PORT) == port:
            self._late = frame
            self.write_register(_TRIGGER_NOW, 1)

    def _fill(self, buffer: int, _: int, exposure_us: int, __: int, ___: int) -> None:
        """Fill a buffer with a picture; called by the library's own thread."""
        lost = 1.0  # nothing is sent where no picture could be taken
        try:
            late, self._late = self._late, None
            frame = late or self._next()
            if frame.silent:
                self._ends.wait(SILENT_S)
            elif frame.slow_s and late is None:
                self._later(frame)
            else:
                self._lay(frame.grey, buffer, exposure_us)
                lost = frame.lost
        except Exception as error:  # the library cannot pass it on
            self.failed = error
        finally:
            with self._open:
                if self._camera is not None:
                    self._library.set_property(self._camera, "gvsp-lost-ratio", float(lost))

    def _require_listening(self) -> None:
        """Check that what answers on the port is this camera; the library does not tell.

        Raises:
            ConnectError: It is not; or no interface has that very address.
        """
        if not self._library.call("arv_gv_fake_camera_is_running", self._camera):
            self.close()
            raise _cannot_listen(self.address, EADDRNOTAVAIL)
        mark = secrets.randbits(32)
        self.write_register(_SCRATCH, mark)
        with gvcp_channel(self.address) as channel:
            if channel.read(_SCRATCH) != mark:
                self.close()
                raise _cannot_listen(self.address, EADDRINUSE)

    def _lay(self, grey: "npt.NDArray[np.uint8]", buffer: int, exposure_us: int) -> None:
        import numpy as np

        start = self._library.call("arv_buffer_get_data", buffer, None)
        size = self._library.call("arv_fake_camera_get_payload", self._fake)
        region = [ctypes.c_int() for _ in range(4)]
        self._library.call("arv_buffer_get_image_region", buffer, *map(ctypes.byref, region))
        x, y, width, height = (end.value for end in region)
        if grey.shape != (self._size_px[1], self._size_px[0]):
            raise ValueError(grey.shape)
        shown = grey[y : y + height, x : x + width]
        if exposure_us != NOMINAL_EXPOSURE_US:
            bright = shown.astype(np.float32) * (exposure_us / NOMINAL_EXPOSURE_US)
            shown = np.clip(bright, 0, 255).astype(np.uint8)
        data = np.ascontiguousarray(shown).tobytes()
        ctypes.memset(start, 0, size)
        ctypes.memmove(start, data, min(size, len(data)))


def drawn_gige_camera(camera: DrawnCamera, address: str = "127.0.0.1") -> GigeCamera:
    """Serve the drawn pictures of a simulated cell, with the faults of its world.

    Args:
        camera: The camera of the cell. The size of its pictures stays as it is now.
        address: Where it listens.

    Raises:
        ConfigError, ConnectError: As :class:`GigeCamera`.
    """

    def exposed() -> GigeFrame:
        frame = camera.expose()
        faults = frame.faults
        lost = _HALVED if faults.halved else 0.0
        return GigeFrame(frame.grey, lost=lost, slow_s=faults.slow_s, silent=faults.gone)

    return GigeCamera(exposed, camera.size_px, address=address, note=camera.note)


def fake_description() -> str:
    """Return what the fake camera tells of its features (GenICam XML).

    Raises:
        ConfigError: The library is missing.
    """
    library = aravis()
    camera = library.call("arv_fake_camera_new", b"described")
    try:
        told: bytes = library.call("arv_fake_camera_get_genicam_xml", camera, None)
        return told.decode("utf-8")
    finally:
        library.let_go(camera)


def _require_free(address: str) -> None:
    """Check that nothing listens on the port of GigE Vision.

    Raises:
        ConnectError: Something does, or the address is not this computer's.
    """
    with socket(AF_INET, SOCK_DGRAM) as tried:
        try:
            tried.bind((address, GVCP_PORT))
        except OSError as error:
            raise cannot_listen(address, GVCP_PORT, error) from error


def _cannot_listen(address: str, number: int) -> ConnectError:
    return cannot_listen(address, GVCP_PORT, OSError(number, os.strerror(number)))


def _require_address(address: str) -> None:
    """Check that it is an IPv4 address of loopback.

    Raises:
        ConfigError: It is not.
    """
    try:
        ipaddress.IPv4Address(address)
    except ValueError as error:
        raise ConfigError(
            tr("{address!r} is not an address for a GigE camera.", address=address),
            remedy=tr("Use 127.0.0.1; its port is always 3956."),
        ) from error
    require_loopback(address, allow_remote=False)
