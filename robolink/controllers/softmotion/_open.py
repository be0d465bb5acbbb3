"""From an open link to a PLC mailbox that was met."""

import secrets

from robolink.controllers.softmotion._controller import SoftMotionController
from robolink.controllers.softmotion._device import read_device_id
from robolink.controllers.softmotion._mailbox import Mailbox
from robolink.controllers.softmotion._snapshots import Snapshots
from robolink.controllers.softmotion._wire import MailboxWire
from robolink.model import OutcomeLog
from robolink.transport import MailboxLink


def open_softmotion(
    link: MailboxLink, *, outcomes: OutcomeLog, timeout_s: float = 3.0, owner: int = 0
) -> SoftMotionController:
    """Meet the mailbox and return the controller; the link is closed when that fails.

    Nothing is written: whoever only reads disturbs nobody.

    Args:
        link: An open link; the controller owns it from here on.
        outcomes: Where doubtful outcomes of this PLC are kept.
        timeout_s: Longest wait for the PLC to acknowledge a command.
        owner: This client's token; by default one that nobody else has.

    Raises:
        ConnectError: The mailbox program does not run.
        RemoteProtocolError: It is no mailbox of this version, or its words stand elsewhere.
    """
    wire = MailboxWire(link, owner=owner or 1 + secrets.randbelow(0xFFFF_FFFF), timeout_s=timeout_s)
    try:
        snapshots = Snapshots(wire)
        snapshots.meet()
        device_id = read_device_id(wire)
        return SoftMotionController(Mailbox(wire, snapshots, outcomes, device_id=device_id))
    except BaseException:
        wire.close()
        raise
