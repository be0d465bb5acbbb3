"""Who a PLC with a mailbox is: the number that its program drew once, or its address."""

from robolink.controllers.softmotion._wire import MailboxWire
from robolink.model import Identity


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
