"""Stops a group over a link of its own and confirms that it stands.

Nothing is imported here that the frame of a stop does not need: what tells the state, and which PLC
it is, comes behind it.
"""

from typing import TYPE_CHECKING

from robolink.controllers.softmotion.commands import CommandSender
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.controllers.stop_attempts import StopMeans, tell_what_is_said_twice
from robolink.errors import Concerning
from robolink.transport import LinkUrl

if TYPE_CHECKING:
    from collections.abc import Callable

    from robolink.model import ControllerStatus


def stop_over_new_link(link: LinkUrl, means: StopMeans) -> "ControllerStatus":
    """Stop the group, and return the state that confirms it; one attempt.

    Args:
        link: Which PLC.
        means: How it is reached.

    Raises:
        RobolinkError: As :meth:`CommandSender.bring_to_rest`, and as the link.
    """
    from robolink.transport import open_mailbox_link

    password = None
    if means.password:
        from robolink.model import Secret  # here, because no other mailbox has a login

        password = Secret(means.password)
    mailbox = open_mailbox_link(
        link, timeout_s=means.timeout_s, clock=means.clock, password=password, stopping=True
    )
    wire = MailboxWire(mailbox, owner=means.owner, timeout_s=means.timeout_s)
    try:
        with Concerning(wire.identity):
            now = CommandSender(wire, Snapshots(wire)).bring_to_rest()
        from robolink.controllers.softmotion.condition import status_of

        if means.met is not None:
            _tell_which(wire, means.met)
        return status_of(now)
    finally:
        wire.close()


def _tell_which(wire: MailboxWire, met: "Callable[[str], None]") -> None:
    """Say which PLC has stopped, if its program has a number."""
    from robolink.controllers.softmotion.mailbox import identity_of, read_device_id

    def asked() -> str:
        device_id = read_device_id(wire)
        return "" if device_id is None else identity_of(wire, device_id).name

    tell_what_is_said_twice(asked, met)
