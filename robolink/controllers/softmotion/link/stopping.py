"""Bringing the axis group behind a mailbox to rest, and knowing that it rests.

Stop (opcode 2003) needs neither ownership nor the machine's permit (docs/mailbox.md, "What ends by
itself"). Its block is done when the group stands (docs/reference/softmotion.md 2.2). A group that
is disabled, in error or held by an earlier stop refuses it, and may yet be braking, so there the
axes themselves are compared.
"""

from typing import Final

from robolink.controllers.softmotion.link.commands import CommandSender
from robolink.controllers.softmotion.link.snapshots import Snapshots
from robolink.errors import OutcomeUnknownError, RejectedError
from robolink.messages import tr
from robolink.protocols.mailbox import Bits, ErrorClass, Response
from robolink.timing import Clock, Deadline

REST_S: Final = 5.0
"""Longest time from the stop to a state that shows rest (docs/reference/rules.md 5)."""

_ALREADY: Final = frozenset({ErrorClass.STOPPING, ErrorClass.DISABLED, ErrorClass.ERRORSTOP})
_LOOK_S: Final = 0.1
_STILL: Final = 0.05
"""An axis that changed by less than this, in its units, in :data:`_LOOK_S` stands: drives hold
a position within microns and millidegrees, and robolink moves no slower than 1 mm/s."""


def bring_group_to_rest(
    commands: CommandSender, snapshots: Snapshots, clock: Clock, *, controller: str
) -> Response:
    """Send 2003 and return a snapshot that shows rest.

    Args:
        commands: Commands of the mailbox.
        snapshots: Reads of it.
        clock: The clock on which the PLC's time passes.
        controller: Its name in errors.

    Raises:
        RejectedError: The PLC knows no stop: its program moves nothing.
        OutcomeUnknownError: The group does not come to rest within :data:`REST_S`.
        TransportError, RemoteProtocolError: The link is over; whether it stops is not known.
    """
    deadline = Deadline.after(clock, REST_S)
    try:
        done = commands.stop()
        now = snapshots.take()
        while not done(now):
            if deadline.expired:
                raise _restless(controller)
            now = snapshots.news(now)
        # A stop of another thread that came meanwhile ends ours before the group stands.
        stands = not now.bits & Bits.BUSY
    except RejectedError as error:
        if error.code not in _ALREADY:
            raise
        now, stands = snapshots.take(), False
    # Here, because nothing may stand before the frame of a stop (docs/reference/rules.md 5).
    from robolink.controllers.softmotion.link.condition import is_moving

    while is_moving(now) or not stands:
        if deadline.expired:
            raise _restless(controller)
        before, looked = now, Deadline.after(clock, _LOOK_S)
        while not looked.expired:
            now = snapshots.news(now, wait_s=looked.remaining_s())
        stands = stands or _still(before, now)
    return now


def _still(before: Response, now: Response) -> bool:
    return before.plc_heartbeat != now.plc_heartbeat and all(
        abs(a - b) < _STILL for a, b in zip(before.axes, now.axes, strict=True)
    )


def _restless(controller: str) -> OutcomeUnknownError:
    return OutcomeUnknownError(
        tr(
            "{controller} was told to stop, but did not show within {seconds:g} s "
            "that it is at rest.",
            controller=controller,
            seconds=REST_S,
        ),
        remedy=tr("It may still be moving."),
        controller=controller,
        request="Stop",
    )
