"""From a URL, or an open link, to a PLC mailbox that was met."""

import secrets

from robolink.controllers.registry import ConnectionTerms
from robolink.controllers.softmotion.controller import SoftMotionController
from robolink.controllers.softmotion.link.device import read_device_id
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.link.snapshots import Snapshots
from robolink.controllers.softmotion.link.wire import MailboxWire
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Controller, OutcomeLog
from robolink.transport import LinkUrl, MailboxLink, open_mailbox_link, open_quick_link
from robolink.ways import Way, way


def open_softmotion_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the PLC at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        ConfigError: The dialogue was to be recorded; and as the link.
        RobolinkError: As :func:`open_softmotion`, and as the link.
    """
    if terms.trace is not None:
        raise ConfigError(
            tr("The dialogue with a PLC mailbox cannot be recorded."),
            remedy=tr(
                "Leave {record} out; a network capture shows the registers.",
                record=way(Way.RECORD),
            ),
        )
    opener = open_quick_link if terms.glance else open_mailbox_link
    link = opener(url, timeout_s=terms.timeout_s, clock=terms.clock)
    return open_softmotion(link, outcomes=terms.record_of(link), timeout_s=terms.timeout_s)


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
