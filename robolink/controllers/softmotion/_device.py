"""Which PLC answers: the number that it drew once, the same on every link.

Source: docs/mailbox.md, "Which PLC this is".
"""

from typing import Final, Protocol

from robolink.errors import RejectedError
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
