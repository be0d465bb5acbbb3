"""The seam between a simulated device and whatever hosts it."""

from typing import Protocol, runtime_checkable


class DeviceLink(Protocol):
    """One client's connection to a simulated device. Bytes in, bytes out, no I/O."""

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""

    @property
    def closed(self) -> bool:
        """Whether the device has ended this connection (after what is outgoing)."""


@runtime_checkable
class ResettableLink(Protocol):
    """A connection that a device may end with a reset."""

    @property
    def reset(self) -> bool:
        """Whether it has ended it so, which is told at once and differently."""


class WireDevice(Protocol):
    """A simulated device that clients can connect to. Time is given, never taken."""

    def connect(self, now_ns: int) -> DeviceLink:
        """Accept one client."""

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
