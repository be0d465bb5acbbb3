"""Movements that were sent and whose end is not read: at most four (docs/mailbox.md, "Movements").

The PLC names the last four ends by their sequence. Every snapshot is looked through for them,
whatever it was read for, because a later end may push an earlier one out.
"""

from typing import Final

from robolink.errors import BusyError
from robolink.messages import tr
from robolink.protocols.mailbox import CommandState, Finished, Response

MOST: Final = 4
"""Movements whose end may be unread."""


class MotionTracker:
    """The movements of one client.

    Attributes:
        jogging: Whether a jog of this client is under way.
    """

    def __init__(self, owner: int) -> None:
        self._owner = owner
        self._ends: dict[int, Finished | None] = {}
        self.jogging = False

    @property
    def unfinished(self) -> bool:
        """Whether something of ours may be moving, so that the PLC wants our heartbeat."""
        return self.jogging or None in self._ends.values()

    @property
    def alone(self) -> bool:
        """Whether there is one movement and no more, so that the head shows how it fares."""
        return len(self._ends) == 1

    @property
    def unread(self) -> bool:
        """Whether there are movements whose end nobody has taken."""
        return bool(self._ends)

    def require_room(self, request: str, *, controller: str) -> None:
        """Refuse a fifth movement.

        Raises:
            BusyError: Four are unread.
        """
        if len(self._ends) >= MOST:
            raise BusyError(
                tr("{request} has to wait: four movements are unfinished.", request=request),
                remedy=tr("Wait for the first of them, then send the next."),
                controller=controller,
                request=request,
            )

    def begin(self, sequence: int) -> None:
        """Expect the end of a movement that is about to be sent."""
        self._ends[sequence] = None

    def forget(self, sequence: int) -> None:
        """Expect it no longer: it was refused, or its end was taken."""
        self._ends.pop(sequence, None)

    def holds(self, sequence: int) -> bool:
        """Whether its end is awaited, or was not taken."""
        return sequence in self._ends

    def end_of(self, sequence: int) -> Finished | None:
        """Return how it ended, ``None`` while that is not known."""
        return self._ends.get(sequence)

    def note(self, now: Response) -> None:
        """Look through a snapshot for ends."""
        if None not in self._ends.values():
            return
        ends = [end for end in now.finished if end.sequence]
        if now.ack_owner == self._owner and has_ended(now.state):
            ends.append(Finished(now.ack_head, now.state, now.error_class))
        for end in ends:
            if has_ended(end.state) and self._ends.get(end.sequence, end) is None:
                self._ends[end.sequence] = end

    def missing(self, sequence: int, now: Response) -> bool:
        """Whether a snapshot shows neither the movement nor its end."""
        return (
            self.end_of(sequence) is None
            and now.active_movement != sequence
            and not now.queue_length
            and (now.ack_head, now.ack_owner) != (sequence, self._owner)
        )


def has_ended(state: int) -> bool:
    """Whether a state is one of the three ends; numbers of a newer PLC are not."""
    return state in (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR)
