"""Who an EPSON controller is, and what else it says about itself and its robots."""

from collections.abc import Sequence
from typing import Final

from robolink.controllers.epson.link.answers import NOT_EXECUTED
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.window import CommandWindow
from robolink.errors import BusyError, ControllerError, NotReadyError, RejectedError
from robolink.model import ControllerFacts, Identity
from robolink.protocols import spel

_UNSET: Final = frozenset({"", "0"})
"""What a text reads as when nobody set it (docs/reference/epson.md 1.8)."""

_QUERY: Final = spel.print_robot_serial()

_NOT_NOW: Final = frozenset({20, 21})
"""Refusals that say nothing about the query itself: the controller is busy
(docs/reference/epson.md 1.6)."""


def name_from(number: Sequence[str], robots: Sequence[str]) -> str:
    """Return the name of a controller, empty where nobody has set any number.

    Args:
        number: The answer to GetContNo.
        robots: The answer to GetRobotSerial; its first field counts the robots.
    """
    numbers = [text for text in (*number, "+".join(robots[1:])) if text not in _UNSET]
    return f"epson:{'/'.join(numbers)}" if numbers else ""


def robot_names(name: str, number: Sequence[str], robots: Sequence[str]) -> tuple[str, ...]:
    """Return the name of each robot of a controller with several, nothing where there is one.

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
    """Asks with two requests, with three where there are several robots; they change nothing.

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
            if error.code in _NOT_NOW:
                raise _BusyNow from error
            return None
        return tuple(field.strip() for field in fields)

    def _in_force(self, robots: Sequence[str]) -> str:
        """Return the name of the robot that Execute acts on, empty where there is one."""
        if not robots:
            return ""
        fields = self._asked("GetCurRobot") or ("",)
        number = int(fields[0]) if fields[0].isdecimal() else 0
        if 1 <= number <= len(robots):
            return robots[number - 1]
        raise _BusyNow  # none is chosen yet: nothing may be put on record of one

    def _printed(self, address: str, place: str) -> Identity:
        try:
            # Nothing is printed while production runs: looking disturbs nobody.
            self._window.require_ready(_QUERY)
            text = self._window.printed(_QUERY).strip()
        except ControllerError as error:
            told = isinstance(error, RejectedError) and error.code not in _NOT_NOW
            return Identity(place, address, place, certain=told)
        return Identity(place if text in _UNSET else f"epson:{text}", address, place)


class _BusyNow(Exception):
    """The controller cannot tell just now."""


class FactReader:
    """Reads :class:`robolink.model.ControllerFacts`.

    The queries of docs/reference/epson.md 1.8 change nothing and are served while production runs
    and to a client that may only monitor. Older firmware refuses them; there the robot's model and
    serial number are printed through Execute, if Execute is available just then.
    """

    def __init__(self, session: EpsonSession, window: CommandWindow) -> None:
        self._session = session
        self._window = window

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
            # Blanks stand inside the version and mean nothing (docs/reference/epson.md 1.8).
            firmware=None if firmware is None else "".join(firmware.split()),
            project=self._text("GetPrjName"),
            robot_number=None if number is None else spel.parse_integer(number),
            robot_models=models,
            robot_serials=serials,
        )

    def _fields(self, name: str, *parameters: str) -> tuple[str, ...] | None:
        try:
            return self._session.exchange(name, *parameters).fields
        except RejectedError as error:
            if error.code in NOT_EXECUTED:
                return None
            raise

    def _text(self, name: str) -> str | None:
        fields = self._fields(name)
        text = "" if fields is None else ",".join(fields).strip()
        return None if text in _UNSET else text

    def _per_robot(self, name: str, *parameters: str, fields_each: int) -> tuple[str, ...]:
        """Return the last field of each robot; nothing when the answer is not so arranged."""
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
            # A controller that serves monitoring only shows nothing of it in its flags.
            return ()
        return (text,) if text else ()
