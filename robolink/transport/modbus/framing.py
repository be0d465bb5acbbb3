"""What every wrapping of Modbus frames has in common. No I/O."""

from typing import Protocol

from robolink.transport.modbus.messages import ModbusReply, ModbusRequest


class FrameError(Exception):
    """Bytes that are no frame of this framing. Internal to the package.

    Attributes:
        raw: The bytes.
    """

    def __init__(self, raw: bytes) -> None:
        super().__init__(raw.hex(" "))
        self.raw = raw


class Framing(Protocol):
    """How frames are wrapped."""

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:
        """Return the frame of ``request``."""

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """Take one frame off the front of ``buffer``, ``None`` while it is incomplete.

        Raises:
            FrameError: The front is no frame.
        """
