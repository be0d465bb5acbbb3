"""Axes that move together: what all kinds of controllers share.

Movements of a controller that takes one request for each, and then is asked about its end.

Most controllers are like that. Those of this package whose protocols ask for more, an answer that
comes by itself (EPSON) or a heartbeat (the mailbox), have their own.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Final

from robolink.controllers.driver_link import DriverLink, DriverPart
from robolink.errors import (
    ControllerError,
    MotionTimeoutError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    StoppedError,
)
from robolink.messages import tr
from robolink.model import (
    InputEdge,
    Marker,
    MarkerKind,
    Motion,
    MotionOutcome,
    MotionProfile,
    MotionTerms,
    MotionUntilInput,
    Path,
    Pose,
    ToolTable,
    WorkBox,
    require_target,
)
from robolink.timing import Deadline


class MotionGroupCore(DriverPart, ABC):
    """Implements :class:`robolink.model.MotionGroup`; each kind of controller adds its own part.

    What only some kinds can do, a movement until an input switches, is refused here by name.

    Args:
        link: The controller.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """What a person calls it."""

    @abstractmethod
    def pose(self) -> Pose:
        """Read where the frame of the selected tool is now (measured, not commanded)."""

    @abstractmethod
    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> Motion:
        """Start one movement; see the model."""

    @abstractmethod
    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        """Return what :meth:`move_to` would send besides its reads, as sent on the wire."""

    @abstractmethod
    def stop(self) -> None:
        """Stop everything; from here on nothing acts before ``release_stop``."""

    def terms(self) -> MotionTerms:
        """Return what a person must know before it moves."""
        return MotionTerms(
            tr("{group} of {identity}", group=self.name, identity=self._driver.identity),
            tr("Nothing stops it if this computer loses the connection."),
        )

    def obstacle(self, target: Pose, path: Path, *, start: Pose | None = None) -> str:
        """Return why the arm could not make this move; nothing if this kind cannot tell."""
        return ""

    def deceleration_mm_s2(self) -> float | None:
        """Return how it brakes in straight movements; nothing if unknown."""
        return None

    def run_up_mm(self, speed_mm_s: float) -> float | None:
        """Return the distance in which it reaches a speed; nothing if unknown."""
        return None

    def edge_step_mm(self, speed_mm_s: float) -> float | None:
        """Return the step of the edge positions that it reports; nothing if unknown."""
        return None

    def require_able(self, purpose: str) -> None:
        """Refuse if no movement could start now; see the model."""

    def base(self) -> tuple[float, ...] | None:
        """Return the place of the base, from which positions count; none if this kind has none."""
        return None

    def axes(self) -> Mapping[str, tuple[float, ...]]:
        """Read the positions of the axes; none if this kind does not report them."""
        return {}

    def motors_on(self) -> bool | None:
        """Read whether its motors are on; none if this kind does not report it."""
        return None

    def low_power(self) -> bool | None:
        """Read whether it moves with low power; none if this kind has no such mode."""
        return None

    def move_until_input(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float, box: WorkBox
    ) -> MotionUntilInput:
        """Start a straight movement until an input switches; see the model.

        Raises:
            ConfigError: This kind of controller has none.
        """
        raise self._driver.lacks(tr("movement until an input switches"))

    def requests_until(
        self, target: Pose, edge: InputEdge, *, speed_mm_s: float
    ) -> tuple[str, ...]:
        """Return what :meth:`move_until_input` would send besides its reads; raises as it."""
        raise self._driver.lacks(tr("movement until an input switches"))

    def abort_unfinished(self) -> None:
        """End the movements that were started here and whose end was not seen."""

    def _marked(self, target: Pose, request: str, *, selected: int | None) -> Marker:
        """Store the marker of a movement that is about to be sent to where its own tool stands.

        Args:
            target: Where it goes.
            request: What is sent, as a person may read it.
            selected: The tool that was read as the one in force.

        Raises:
            NotReadyError: The target is meant for another tool; nothing may be sent.
        """
        self._require_tool(target, selected)
        details = {"target": list(target.coordinates())}
        return self._driver.markers.begin(MarkerKind.MOVE, request, details)

    def _require_tool(self, target: Pose, found: int | None) -> None:
        """Refuse a target for another tool than the selected one.

        Raises:
            NotReadyError: Names both.
        """
        if target.tool is None or target.tool != found:
            raise NotReadyError(
                tr(
                    "The target is meant for tool {meant}, but tool {found} is selected.",
                    meant=target.tool,
                    found=found,
                ),
                reason=NotReadyReason.WRONG_TOOL,
                remedy=tr("Nothing moved. Select the right tool first."),
            )


def not_ended_in_time(request: str, timeout_s: float) -> MotionTimeoutError:
    """Return the error for a movement that took too long and was aborted."""
    return MotionTimeoutError(
        tr(
            "{statement!r} did not end within {timeout_s:.0f} s; robolink aborted it.",
            statement=request,
            timeout_s=timeout_s,
        ),
        remedy=tr("Check where the robot is ('robolink robot where') before you continue."),
    )


def stopped_before_edge(controller: str, request: str) -> StoppedError:
    """Return the error for a movement that ended before its input switched, nor arrived."""
    return StoppedError(
        tr("The movement was stopped before the input switched."),
        remedy=tr("The robot will not move by itself. Start again when the cell is clear."),
        controller=controller,
        request=request,
    )


_POLL_S: Final = 0.02
_REST_S: Final = 5.0
"""Longest time from a stop to a confirmed stop state, in s (docs/reference/rules.md 5)."""


class PolledGroup(MotionGroupCore):
    """One group of axes that takes a target, and reports whether it moves.

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
        """Send a stop; allowed at any time, and more than once."""

    def move_to(self, target: Pose, profile: MotionProfile, *, box: WorkBox) -> "PolledMotion":
        """Start one movement; see :class:`robolink.model.MotionGroup`."""
        require_target(target, box, profile)
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
            # The caller gets no motion object to wait on.
            self.abort_unfinished()
            raise
        return self._current

    def stop(self) -> None:
        """Stop it; from here on nothing acts before ``release_stop``.

        Raises:
            OutcomeUnknownError: It did not come to rest in time.
        """
        with self._driver.latch.stopping():
            self.halt()

    def halt(self) -> None:
        """Stop it; it may be moved again at once.

        Raises:
            OutcomeUnknownError: It did not come to rest in time.
        """
        deadline = Deadline.after(self._driver.clock, _REST_S)
        self._send_stop()
        while self.moving():
            if deadline.expired:
                raise OutcomeUnknownError(
                    tr(
                        "{controller} accepted the stop, but did not confirm within "
                        "{seconds:g} s that the robot has stopped.",
                        controller=self._driver.identity,
                        seconds=_REST_S,
                    ),
                    remedy=tr("It may still be moving."),
                    request="stop",
                )
            self._driver.clock.sleep(_POLL_S)

    def abort_unfinished(self) -> None:
        """Halt the last movement unless its end was seen."""
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
                raise not_ended_in_time(request, timeout_s)
            self._settle()
        return MotionOutcome.STOPPED if self._aborted else MotionOutcome.ARRIVED

    def abort(self) -> None:
        """Halt it and confirm that it has stopped.

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
