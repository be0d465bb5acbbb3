"""Who an EPSON controller is: the serial numbers of controller and robot."""

from typing import Final

from robolink.controllers.epson._session import EpsonSession
from robolink.controllers.epson._window import CommandWindow
from robolink.errors import BusyError, ControllerError, RejectedError
from robolink.model import Identity
from robolink.protocols import spel

_UNSET: Final = frozenset({"", "0"})
"""What a text reads as when nobody set it (docs/reference/epson.md 1.8)."""

_QUERY: Final = spel.print_robot_serial()

_NOT_NOW: Final = frozenset({20, 21})
"""Refusals that say nothing about the query itself: the controller is busy
(docs/reference/epson.md 1.6)."""


class IdentityReader:
    """Asks with two requests, which change nothing.

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
        except _BusyNow:
            return Identity(place, address, place, certain=False)
        # The first field of the robots' answer counts them.
        numbers = [text for text in (*number, "+".join(robots[1:])) if text not in _UNSET]
        return Identity(f"epson:{'/'.join(numbers)}" if numbers else place, address, place)

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
