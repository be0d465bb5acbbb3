"""What every part of this driver uses: a session, its command window, and its markers.

What is asked once a connection: the current robot, and what is set in the controller.

Neither changes meanwhile: one client at a time is served, and a change of the preferences restarts
the controller.

Two of the preferences make a measurement worthless and everything else look right: in a dry run
the robot is not moved, and with virtual I/O no input is a real one, while each answer is as ever.
Firmware that knows the query tells them (docs/reference/epson.md 1.11); older firmware answers 11,
and then nothing is assumed and nothing is said.

Who an EPSON controller is, and what else it says about itself and its robots.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from robolink.controllers.driver_link import DriverLink
from robolink.controllers.epson.answers import NOT_EXECUTED, NOT_NOW
from robolink.controllers.epson.session import EpsonSession
from robolink.controllers.epson.window import CommandWindow
from robolink.errors import (
    BusyError,
    ControllerError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
)
from robolink.messages import tr
from robolink.model import ControllerFacts, Identity, OutcomeLog
from robolink.protocols import spel
from robolink.protocols.epson_text import Preference, parse_preferences


@dataclass(frozen=True, slots=True)
class Robot:
    """The current robot: its number on the controller and its type code."""

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
    """Reads which robot is current, when that is first needed.

    Execute acts on the robot chosen with SetCurRobot (docs/reference/epson.md 1.5); robolink never
    changes that choice, but a statement that a person typed may.
    """

    def __init__(self, window: CommandWindow) -> None:
        self._window = window
        self._robot: Robot | None = None

    def forget(self) -> None:
        """Ask again at the next use: another robot may be current."""
        self._robot = None

    def read(self, request: str = "Print Robot") -> Robot:
        """Return the current robot.

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
    """The preferences of one controller.

    Args:
        session: Asks for it, when it is needed first.
    """

    def __init__(self, session: EpsonSession) -> None:
        self._session = session
        self._asked = False
        self._told: frozenset[Preference] | None = None

    def read(self) -> frozenset[Preference] | None:
        """Return the active preferences, ``None`` if the firmware does not show them.

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
            return None  # unknown to this firmware, or not available now
        # An unknown form shows nothing here; verify-controller shows what was received.
        with suppress(RemoteProtocolError):
            return parse_preferences(",".join(fields))
        return None

    def require_real_motion(self, request: str) -> None:
        """Refuse ``request`` while the robot would only seem to move.

        Raises:
            NotReadyError: The controller is set to dry run.
        """
        if Preference.DRY_RUN in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to dry run: the robot does not really move."),
                reason=NotReadyReason.DRY_RUN,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Dry run' off in RC+ (the controller "
                    "restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real_inputs(self, request: str) -> None:
        """Refuse ``request`` while no input is a real one.

        Raises:
            NotReadyError: The controller is set to virtual I/O.
        """
        if Preference.VIRTUAL_IO in (self.read() or ()):
            raise NotReadyError(
                tr("The controller is set to virtual I/O: none of its inputs is real."),
                reason=NotReadyReason.VIRTUAL_IO,
                remedy=tr(
                    "Nothing was sent. Switch the preference 'Virtual I/O' off in RC+ (the "
                    "controller restarts), then try again."
                ),
                controller=self._session.identity,
                request=request,
            )

    def require_real(self, request: str) -> None:
        """Refuse a measurement, or the writing of one, while the cell is not the real one.

        Putting an old value back is let through: left alone, an unproved one would stay in force.

        Raises:
            NotReadyError: Dry run or virtual I/O.
        """
        if self._session.latch.restores:
            return
        self.require_real_motion(request)
        self.require_real_inputs(request)


_UNSET: Final = frozenset({"", "0"})
"""Values of a text that nobody has set (docs/reference/epson.md 1.8)."""

_QUERY: Final = spel.print_robot_serial()


def name_from(number: Sequence[str], robots: Sequence[str]) -> str:
    """Return the name of a controller, empty if no number is set.

    Args:
        number: The answer to GetContNo.
        robots: The answer to GetRobotSerial; its first field counts the robots.
    """
    numbers = [text for text in (*number, "+".join(robots[1:])) if text not in _UNSET]
    return f"epson:{'/'.join(numbers)}" if numbers else ""


def robot_names(name: str, number: Sequence[str], robots: Sequence[str]) -> tuple[str, ...]:
    """Return the name of each robot of a controller with several, nothing if there is one.

    A robot is called as its controller would be with that robot alone, so what was on record
    before a second one came stays its own. One without a number of its own is counted.

    Args:
        name: Of the controller.
        number: The answer to GetContNo.
        robots: The answer to GetRobotSerial; its first field counts the robots.
    """
    serials = robots[1:]
    if len(serials) < 2:
        return ()
    return tuple(
        f"{name}#{place}"
        if serial in _UNSET or serials.count(serial) > 1
        else name_from(number, ("1", serial))
        for place, serial in enumerate(serials, start=1)
    )


class IdentityReader:
    """Asks with two requests, with three if there are several robots; they change nothing.

    Newer firmware tells the serial numbers of controller and robots at any time, to a client
    that only monitors too (docs/reference/epson.md 1.8). Older firmware refuses the first query;
    there the status is read, and where that is ready the robot's serial number is printed through
    Execute. Else it is known by its address until it can be asked.
    """

    def __init__(self, session: EpsonSession, window: CommandWindow) -> None:
        self._session = session
        self._window = window

    def read(self) -> Identity:
        """Return who it is.

        Raises:
            TransportError, RemoteProtocolError: The session is over.
        """
        address, place = self._session.identity, f"epson@{self._session.place}"
        try:
            number = self._asked("GetContNo")
            if number is None:
                return self._printed(address, place)
            robots = self._asked("GetRobotSerial", "0") or ()
            name = name_from(number, robots) or place
            each = robot_names(name, number, robots)
            return Identity(name, address, place, robot=self._in_force(each), robots=each)
        except _BusyNow:
            return Identity(place, address, place, certain=False)

    def _asked(self, name: str, *parameters: str) -> tuple[str, ...] | None:
        """Return the fields of an answer; ``None`` where the firmware does not know the query."""
        try:
            fields = self._session.exchange(name, *parameters).fields
        except BusyError as error:
            raise _BusyNow from error
        except RejectedError as error:
            if error.code in NOT_NOW:
                raise _BusyNow from error
            return None
        return tuple(field.strip() for field in fields)

    def _in_force(self, robots: Sequence[str]) -> str:
        """Return the name of the robot that Execute acts on, empty if there is only one."""
        if not robots:
            return ""
        fields = self._asked("GetCurRobot") or ("",)
        number = int(fields[0]) if fields[0].isdecimal() else 0
        if 1 <= number <= len(robots):
            return robots[number - 1]
        raise _BusyNow  # no robot is selected yet, so nothing may be recorded for one

    def _printed(self, address: str, place: str) -> Identity:
        try:
            # Nothing is printed while production runs: reading must disturb nobody.
            self._window.require_ready(_QUERY)
            text = self._window.printed(_QUERY).strip()
        except ControllerError as error:
            told = isinstance(error, RejectedError) and error.code not in NOT_NOW
            return Identity(place, address, place, certain=told)
        return Identity(place if text in _UNSET else f"epson:{text}", address, place)


class _BusyNow(Exception):
    """The controller cannot answer just now."""


_FIXED: Final = frozenset(
    {
        *("GetRobotInfo", "GetRobotSerial"),
        *("GetContVer", "GetContName", "GetContType", "GetContNo"),
    }
)
"""Queries whose answer only a restart of the controller can change, which ends the session."""


class FactReader:
    """Reads :class:`robolink.model.ControllerFacts`.

    The queries of docs/reference/epson.md 1.8 change nothing and are served while production runs
    and to a client that may only monitor. Older firmware refuses them; there the robot's model and
    serial number are printed through Execute, if Execute is available just then. What stays the
    same in a session is asked once.
    """

    def __init__(self, session: EpsonSession, window: CommandWindow) -> None:
        self._session = session
        self._window = window
        self._answers: dict[str, tuple[str, ...]] = {}

    def read(self) -> ControllerFacts:
        """Return what can be read now."""
        models = self._per_robot("GetRobotInfo", fields_each=2)
        serials = self._per_robot("GetRobotSerial", "0", fields_each=1)
        number = self._text("GetCurRobot")
        firmware = self._text("GetContVer")
        if not (models and serials) and self._execute_available():
            models = models or self._printed(spel.print_robot_model())
            serials = serials or self._printed(spel.print_robot_serial())
        return ControllerFacts(
            controller_name=self._text("GetContName"),
            controller_type=self._text("GetContType"),
            controller_serial=self._text("GetContNo"),
            # Blanks inside the version have no meaning (docs/reference/epson.md 1.8).
            firmware=None if firmware is None else "".join(firmware.split()),
            project=self._text("GetPrjName"),
            robot_number=None if number is None else spel.parse_integer(number),
            robot_models=models,
            robot_serials=serials,
        )

    def model(self, robot: int) -> str | None:
        """Return the model of one robot, ``None`` if the controller does not tell it.

        Args:
            robot: Its number, from 1.
        """
        models = self._per_robot("GetRobotInfo", fields_each=2)
        if not models:
            models = self._printed(spel.print_robot_model()) if self._execute_available() else ()
            robot = 1
        return models[robot - 1] if 1 <= robot <= len(models) else None

    def _fields(self, name: str, *parameters: str) -> tuple[str, ...] | None:
        if name in self._answers:
            return self._answers[name]
        try:
            fields = self._session.exchange(name, *parameters).fields
        except RejectedError as error:
            if error.code in NOT_EXECUTED:
                return None
            raise
        if name in _FIXED:
            self._answers[name] = fields
        return fields

    def _text(self, name: str) -> str | None:
        fields = self._fields(name)
        text = "" if fields is None else ",".join(fields).strip()
        return None if text in _UNSET else text

    def _per_robot(self, name: str, *parameters: str, fields_each: int) -> tuple[str, ...]:
        """Return the last field of each robot; nothing if the answer has another form."""
        fields = self._fields(name, *parameters)
        if fields is None or not fields[0].isdecimal():
            return ()
        if len(fields) != 1 + int(fields[0]) * fields_each:
            return ()
        return tuple(field.strip() for field in fields[fields_each::fields_each])

    def _execute_available(self) -> bool:
        try:
            self._window.require_ready("Print RobotModel$")
        except NotReadyError:
            return False
        return True

    def _printed(self, query: spel.Statement) -> tuple[str, ...]:
        try:
            text = self._window.printed(query).strip()
        except RejectedError:
            # A controller set to monitoring only does not show it in its flags.
            return ()
        return (text,) if text else ()


class EpsonLink(DriverLink):
    """One controller after the login.

    Attributes:
        session: Requests and answers.
        window: Statements, as if typed in the controller's command window.
        preferences: What is set in the controller.
        robot: Which robot statements act on.
        facts: Reads which controller and robots these are.

    Args:
        session: A session that has logged in.
        outcomes: Where doubtful outcomes of this controller are kept.
    """

    def __init__(self, session: EpsonSession, outcomes: OutcomeLog) -> None:
        self.session = session
        self.window = CommandWindow(session)
        self.preferences = Preferences(session)
        self.robot = RobotFacts(self.window)
        self.facts = FactReader(session, self.window)
        self._reader = IdentityReader(session, self.window)
        outcomes.ask(self._reader.read)
        super().__init__(
            session.identity, session.clock, session.latch, outcomes, gate=session.uninterrupted()
        )

    @property
    def session_over(self) -> bool:
        """Whether its conversation has ended for good."""
        return not self.session.alive

    def forget_robot(self) -> None:
        """Ask anew, at the next use, which robot is current, and whose record it is."""
        self.robot.forget()
        self.markers.outcomes.ask(self._reader.read)

    def model(self) -> str | None:
        """Read the model of the current robot, ``None`` if the controller does not tell it."""
        return self.facts.model(self.robot.read().number)

    def was_not_executed(self, refusal: RejectedError) -> bool:
        """Whether a refusal confirms that nothing was done (docs/reference/epson.md 1.6)."""
        return refusal.code in NOT_EXECUTED
