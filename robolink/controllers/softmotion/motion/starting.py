"""Starting a movement: everything that must be true before it, and its marker."""

from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.condition import (
    require_beats,
    require_enabled,
    require_power,
    require_still,
)
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.motion.movement import SoftMotionMotion
from robolink.errors import (
    ConfigError,
    ControllerError,
    NotReadyError,
    NotReadyReason,
    StoppedError,
)
from robolink.messages import tr
from robolink.model import MarkerKind, Pose
from robolink.protocols.mailbox import Command, Response


class MovementStarter:
    """Starts the movements of one group and remembers those whose end is not seen."""

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox
        self._current: list[SoftMotionMotion] = []

    def abort_unfinished(self) -> None:
        """Halt what was sent here and not seen to its end."""
        for motion in self._current:
            if not motion.settled:
                motion.abort()

    def start(self, target: Pose, draft: Command) -> SoftMotionMotion:
        """Start a movement that lies inside the limits; see ``MotionGroup.move_to``."""
        mailbox, request = self._mailbox, describe(draft)
        try:
            with mailbox.lock.held(request):
                mailbox.wire.motions.require_room(request, controller=mailbox.identity)
                now = self.require_startable(draft, request)
                self._require_tool(target, now, request)
                with mailbox.uninterrupted():
                    motion = self._started(target, draft, request)
                    self._current = [*(m for m in self._current if not m.settled), motion]
                return motion
        except (KeyboardInterrupt, StoppedError):
            # Nobody will be given this motion to wait on.
            self.abort_unfinished()
            raise

    def _started(self, target: Pose, draft: Command, request: str) -> SoftMotionMotion:
        mailbox = self._mailbox
        details = {"target": list(target.coordinates())}
        marker = mailbox.markers.begin(MarkerKind.MOVE, request, details)
        with mailbox.markers.doubt(request):
            try:
                command = mailbox.commands.start(draft)
            except (ControllerError, ConfigError, StoppedError, KeyboardInterrupt):
                mailbox.markers.clear(marker)  # it was not sent, or refused
                raise
        return SoftMotionMotion(target, command, marker, mailbox)

    def require_startable(self, draft: Command, request: str) -> Response:
        """Hold back what may not start now; see :mod:`._condition`.

        Raises:
            ConfigError: The line is too slow for any movement.
            NotReadyError: The group, its drives, the machine or another movement forbid it.
            OutcomeUnknownError: Something earlier is unsettled.
            LeaseHeldError, LeaseLostError: Another client owns the mailbox.
        """
        mailbox = self._mailbox
        require_beats(mailbox.wire.whole_look_s, controller=mailbox.identity, request=request)
        self.require_settled(request)
        now = mailbox.prepare(draft, request)
        require_enabled(now, controller=mailbox.identity, request=request)
        require_power(now, controller=mailbox.identity, request=request)
        if not mailbox.wire.motions.unfinished:
            require_still(now, controller=mailbox.identity, request=request)
        return now

    def require_settled(self, request: str) -> None:
        """Hold ``request`` back while something earlier is unsettled."""
        # The markers of our own movements under way do not count; what was open before the
        # first of them would have held that one back.
        if not self._mailbox.wire.motions.unread:
            self._mailbox.markers.require_settled(request)

    def _require_tool(self, target: Pose, now: Response, request: str) -> None:
        if target.tool != now.tool_slot:
            raise NotReadyError(
                tr(
                    "The target is meant for tool {meant}, but tool {found} is in force.",
                    meant=target.tool,
                    found=now.tool_slot,
                ),
                reason=NotReadyReason.WRONG_TOOL,
                remedy=tr("Nothing was moved. Select the right tool first."),
                controller=self._mailbox.identity,
                request=request,
            )
