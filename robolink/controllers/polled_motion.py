"""Movements of a controller that takes one request for each, and then is asked about its end.

Most controllers are like that. Those of this package whose protocols ask for more, an answer that
comes by itself (EPSON) or a heartbeat (the mailbox), have their own.
"""

from abc import abstractmethod
from typing import Final

from robolink.controllers.driver_link import DriverLink
from robolink.controllers.motion_group import MotionGroupCore, not_ended_in_time
from robolink.errors import (
    ControllerError,
    OutcomeUnknownError,
    StoppedError,
)
from robolink.messages import tr
from robolink.model import Marker, MotionOutcome, MotionProfile, Pose, ToolTable, WorkBox
from robolink.timing import Deadline

_POLL_S: Final = 0.02
_REST_S: Final = 5.0
"""Longest time from a stop to a state that shows rest (docs/reference/rules.md 5)."""


class PolledGroup(MotionGroupCore):
    """One group of axes that is told where to go, and says whether it moves.

    Args:
        link: The controller.
        tools: Its tools; a target counts for the one in force.
    """

    def __init__(self, link: DriverLink, tools: ToolTable) -> None:
        super().__init__(link)
        self._tools = tools
        self._current: PolledMotion | None = None

    @abstractmethod
    def moving(self) -> bool:
        """Read whether it moves; raises ControllerError where it has gone into error."""

    @abstractmethod
    def _send_move(self, target: Pose, profile: MotionProfile) -> None:
        """Send one movement; raises unless the controller accepted it."""

    @abstractmethod
    def _send_stop(self) -> None:
        """Tell it to come to rest; legal at any time, and more than once."""

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> "PolledMotion":
        """Start one movement; see :class:`robolink.model.MotionGroup`."""
        box.check(target)
        link, markers = self._driver, self._driver.markers
        request = "; ".join(self.requests_for(target, profile))
        try:
            with link.lock.held(request):
                self.require_able(request)
                selected = self._tools.selected()
                with link.uninterrupted():
                    marker = self._marked(target, request, selected=selected)
                    with markers.doubt(request):
                        try:
                            self._send_move(target, profile)
                        except (ControllerError, StoppedError):
                            markers.clear(marker)  # it was refused, or never sent
                            raise
                    self._current = PolledMotion(self, link, target, marker)
        except (KeyboardInterrupt, StoppedError):
            # Nobody will be given this motion to wait on.
            self.abort_unfinished()
            raise
        return self._current

    def stop(self) -> None:
        """Bring it to rest; from here on nothing acts before ``release_stop``.

        Raises:
            OutcomeUnknownError: It did not come to rest in time.
        """
        with self._driver.latch.stopping():
            self.halt()

    def halt(self) -> None:
        """Bring it to rest; it may be moved again at once.

        Raises:
            OutcomeUnknownError: It did not come to rest in time.
        """
        deadline = Deadline.after(self._driver.clock, _REST_S)
        self._send_stop()
        while self.moving():
            if deadline.expired:
                raise OutcomeUnknownError(
                    tr(
                        "{controller} took the stop, but did not come to rest within {seconds:g} "
                        "s.",
                        controller=self._driver.identity,
                        seconds=_REST_S,
                    ),
                    remedy=tr("It may still be moving."),
                    controller=self._driver.identity,
                    request="stop",
                )
            self._driver.clock.sleep(_POLL_S)

    def abort_unfinished(self) -> None:
        """Halt the last movement if nobody has seen its end."""
        if self._current is not None and not self._current.settled:
            self._current.abort()


class PolledMotion:
    """A movement under way; implements :class:`robolink.model.Motion`.

    Attributes:
        target: Where it goes.
        settled: Whether its end was seen.
    """

    def __init__(self, group: PolledGroup, link: DriverLink, target: Pose, marker: Marker) -> None:
        self.target = target
        self.settled = False
        self._group = group
        self._link = link
        self._marker = marker
        self._aborted = False

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        """Wait for the end; see the model.

        Raises:
            StoppedError: A stop came, whatever the movement did.
        """
        request = self._marker.request
        with self._link.latch.ending(request), self._link.awaited():
            try:
                arrived = self._arrived_within(timeout_s)
            except KeyboardInterrupt:
                self.abort()
                raise
            if not arrived:
                self.abort()
                raise not_ended_in_time(self._link.identity, request, timeout_s)
            self._settle()
        return MotionOutcome.STOPPED if self._aborted else MotionOutcome.ARRIVED

    def abort(self) -> None:
        """Halt it and see it at rest.

        Raises:
            OutcomeUnknownError: No end was seen; the marker stays.
        """
        self._aborted = True
        with self._link.uninterrupted():
            with self._link.markers.doubt(self._marker.request):
                self._group.halt()
            self._settle()

    def _arrived_within(self, timeout_s: float) -> bool:
        deadline = Deadline.after(self._link.clock, timeout_s)
        with self._link.markers.doubt(self._marker.request):
            while not self.settled and self._group.moving():
                if deadline.expired:
                    return False
                self._link.clock.sleep(_POLL_S)
        return True

    def _settle(self) -> None:
        if not self.settled:
            with self._link.uninterrupted():
                self.settled = True
                self._link.markers.clear(self._marker)
