"""Which PLC answers: the number that it drew once, the same on every link.

Source: docs/mailbox.md, "Which PLC this is".
"""

from typing import Final, Protocol

from robolink.controllers.softmotion.link.wire import MailboxWire
from robolink.errors import RejectedError
from robolink.model import Identity
from robolink.protocols.mailbox import decode_device_id

_READS: Final = 3
"""A PLC may be drawing its number just while it is read for the first time."""


class DeviceReading(Protocol):
    """A :class:`robolink.transport.MailboxLink`, as far as it is needed here."""

    def read_device(self) -> tuple[int, ...]:
        """Return the words of the device block."""


def read_device_id(link: DeviceReading) -> int | None:
    """Return the number of the PLC behind a link; it changes nothing.

    Returns:
        ``None`` when its mailbox program has no such number: such a PLC can be known by its
        address only.

    Raises:
        TransportError, RemoteProtocolError: The link failed.
    """
    for _ in range(_READS):
        try:
            words = link.read_device()
        except RejectedError:  # there is nothing at that place
            return None
        device_id = decode_device_id(words)
        if device_id is not None or not any(words[:2]):
            return device_id
    return None


def identity_of(wire: MailboxWire, device_id: int | None) -> Identity:
    """Return who a PLC is, the same over each medium (docs/mailbox.md, "Which PLC this is").

    Args:
        wire: The session.
        device_id: What it said when it was met; ``None`` for a program of before that number,
            which is known by its address.
    """
    place = f"softmotion@{wire.place}"
    name = place if device_id is None else f"softmotion:{device_id:08X}"
    return Identity(name, wire.identity, place)
