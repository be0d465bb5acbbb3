"""What is asked once a connection: the robot in force, and what is set in the controller.

Neither changes meanwhile: one client at a time is served, and a change of the preferences restarts
the controller.

Two of the preferences make a measurement worthless and everything else look right: in a dry run
the robot is not moved, and with virtual I/O no input is a real one, while each answer is as ever.
Firmware that knows the query tells them (docs/reference/epson.md 1.11); older firmware answers 11,
and then nothing is assumed and nothing is said.
"""

from contextlib import suppress
from dataclasses import dataclass

from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.window import CommandWindow
from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
)
from robolink.messages import tr
from robolink.protocols import spel
from robolink.protocols.epson_text import Preference, parse_preferences


@dataclass(frozen=True, slots=True)
class Robot:
    """The robot in force: its number on the controller and its type code."""

    number: int
    type_code: int

    @property
    def six_axes(self) -> bool:
        """Whether V and W exist."""
        return spel.tilts_tool(self.type_code)

    @property
    def folds(self) -> bool:
        """Whether it is an RS, whose arm folds under itself onto the axis of joint 1."""
        return self.type_code == spel.RobotType.RS


class RobotFacts:
    """Reads which robot is in force, when that is needed first.

    Execute acts on the robot chosen with SetCurRobot (docs/reference/epson.md 1.5); robolink never
    changes that choice, but a statement that a person typed may.
    """

    def __init__(self, window: CommandWindow) -> None:
        self._window = window
        self._robot: Robot | None = None

    def forget(self) -> None:
        """Ask again when it is needed next: another robot may be in force."""
        self._robot = None

    def read(self, request: str = "Print Robot") -> Robot:
        """Return the robot in force.

        Args:
            request: What needs to know it.

        Raises:
            NotReadyError: The controller answers no question now.
        """
        if self._robot is None:
            with self._window.proving_ready(request):
                number = spel.parse_integer(self._window.printed(spel.print_robot()))
                kind = spel.parse_robot_type(self._window.printed(spel.print_robot_type()))
            self._robot = Robot(number, kind)
        return self._robot


class Preferences:
    """What is set in one controller.

    Args:
        session: Asks for it, when it is needed first.
    """

    def __init__(self, session: EpsonSession) -> None:
        self._session = session
        self._asked = False
        self._told: frozenset[Preference] | None = None

    def read(self) -> frozenset[Preference] | None:
        """Return the preferences that are on, ``None`` where the firmware does not tell.

        Raises:
            TransportError, RemoteProtocolError: The session is over.
        """
        pending = self._session.pending
        if not self._asked and (pending is None or pending.answer is not None):
            self._told = self._ask()
            self._asked = True
        return self._told

    def _ask(self) -> frozenset[Preference] | None:
        try:
            fields = self._session.exchange("GetContSettings").fields
        except RejectedError:
            return None  # not known to this firmware, or not to be had now
        # In a form that is not known it tells nothing; verify-controller shows what it was.
        with suppress(RemoteProtocolError):
            return parse_preferences(",".join(fields))
        return None

    def require_real_motion(self, request: str) -> None:
        """Hold ``request`` back while the robot would only seem to move.

        Raises:
            NotReadyError: The controller is set to dry run.
        """
        if Preference.DRY_RUN in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to dry run: the robot would only seem to move."),
                reason=NotReadyReason.DRY_RUN,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Dry run' off in RC+ (the controller "
                    "restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real_inputs(self, request: str) -> None:
        """Hold ``request`` back while no input is a real one.

        Raises:
            NotReadyError: The controller is set to virtual I/O.
        """
        if Preference.VIRTUAL_IO in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to virtual I/O: none of its inputs is a real one."),
                reason=NotReadyReason.VIRTUAL_IO,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Virtual I/O' off in RC+ (the "
                    "controller restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real(self, request: str) -> None:
        """Hold a measurement, or the writing of one, back while the cell is not the real one.

        Putting an old value back is let through: left alone, an unproved one would stay in force.

        Raises:
            NotReadyError: Dry run or virtual I/O.
        """
        if self._session.latch.restores:
            return
        self.require_real_motion(request)
        self.require_real_inputs(request)
