"""GVCP, the control channel of GigE Vision: reads and writes one register of a camera, by itself.

Who has a camera, and whether anything answers at all, stands in one register that everybody may
read. Asked in this way it is known within a second; the library tries for 2.5 s each time, and
tells neither case from the other.

Source: GigE Vision 2.0, 14 to 16 and 28, as in ``arvgvcpprivate.h`` of Aravis 0.8.26.
"""

import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Final

from robolink.runtime import monotonic_ns
from robolink.timing import NS_PER_S

__all__ = [
    "CONTROL",
    "EXCLUSIVE",
    "GVCP_PORT",
    "GvcpChannel",
    "GvcpRefusedError",
    "HEARTBEAT_MS_REGISTER",
    "PRIVILEGE_REGISTER",
    "gvcp_channel",
    "privilege",
]

GVCP_PORT: Final = 3956

PRIVILEGE_REGISTER: Final = 0x0A00
"""Says whether a program has the camera: :data:`CONTROL` or :data:`EXCLUSIVE`; 0 if none has."""

CONTROL: Final = 2
"""A program has the camera; others may read."""

EXCLUSIVE: Final = 1
"""A program has the camera; others may do nothing."""

HEARTBEAT_MS_REGISTER: Final = 0x0938
"""After which silence, in ms, a camera leaves the program that has it; 3000 as a rule."""

_HEAD: Final = struct.Struct(">HHHH")
_KEY_AND_ACKNOWLEDGE: Final = 0x4201
_READ: Final = 0x0080
_WRITE: Final = 0x0082
_numbers = count(1)


class GvcpRefusedError(Exception):
    """The camera refuses a request; ``args[0]`` is its status, 0x8006 for access denied."""


class GvcpChannel:
    """Registers of one camera.

    Args:
        connected: A UDP socket that is connected to it.
        timeout_s: How long an answer may take.
        tries: How often is asked.
    """

    def __init__(self, connected: socket.socket, timeout_s: float, tries: int) -> None:
        self._socket = connected
        self._timeout_s = timeout_s
        self._tries = tries

    @property
    def own_address(self) -> str:
        """Address of this computer from which the camera is reached."""
        return str(self._socket.getsockname()[0])

    def read(self, register: int) -> int | None:
        """Return what a register holds; ``None`` where nothing answers.

        Raises:
            GvcpRefusedError: The camera refuses it.
        """
        answer = self._asked(_READ, struct.pack(">I", register), 4)
        return None if answer is None else int(struct.unpack(">I", answer)[0])

    def write(self, register: int, value: int) -> bool:
        """Write a register; ``False`` where nothing answers.

        Raises:
            GvcpRefusedError: The camera refuses it.
        """
        return self._asked(_WRITE, struct.pack(">II", register, value), 0) is not None

    def _asked(self, command: int, body: bytes, least: int) -> bytes | None:
        for _ in range(self._tries):
            number = next(_numbers) % 0xFFFF + 1  # 0 is none
            request = _HEAD.pack(_KEY_AND_ACKNOWLEDGE, command, len(body), number) + body
            try:
                self._socket.send(request)
                answer = self._answer(command + 1, number, least)
            except OSError:
                continue  # this computer has no way to it, or its port is closed
            if answer is not None:
                return answer
        return None

    def _answer(self, command: int, number: int, least: int) -> bytes | None:
        until_ns = monotonic_ns() + int(self._timeout_s * NS_PER_S)
        while (left_ns := until_ns - monotonic_ns()) > 0:
            self._socket.settimeout(left_ns / NS_PER_S)
            try:
                came = self._socket.recv(2048)
            except TimeoutError:
                return None
            if len(came) < _HEAD.size:
                continue
            status, answered, _, to = _HEAD.unpack_from(came)
            if (answered, to) != (command, number):
                continue  # of a request before
            if status:
                raise GvcpRefusedError(status)
            if len(came) >= _HEAD.size + least:
                return came[_HEAD.size : _HEAD.size + least]
        return None


@contextmanager
def gvcp_channel(
    address: str, *, timeout_s: float = 0.4, tries: int = 3, port: int = GVCP_PORT
) -> Iterator[GvcpChannel]:
    """Open the control channel of a camera for a block; takes nothing from anybody.

    Args:
        address: The camera's IPv4 address.
        timeout_s: How long an answer may take.
        tries: How often is asked.
        port: Of the camera.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as connected:
        # Connected, so only the camera is heard, and a closed port is known at once.
        connected.connect((address, port))
        yield GvcpChannel(connected, timeout_s, tries)


def privilege(address: str) -> int | None:
    """Return who has a camera: bits of its register; ``None`` where nothing answers."""
    try:
        with gvcp_channel(address) as channel:
            return channel.read(PRIVILEGE_REGISTER)
    except GvcpRefusedError:
        return EXCLUSIVE  # not even reading is allowed
    except OSError:
        return None  # this computer has no way to it
