"""A controller's identity, whatever the URL: its own answer, and the password that it takes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias


class Secret:
    """A password that no format, log or traceback of robolink can show."""

    __slots__ = ("_value",)

    def __init__(self, value: str) -> None:
        self._value: Final = value

    def reveal(self) -> str:
        """Return the text. Only the code that builds the login frame calls it."""
        return self._value

    def __repr__(self) -> str:
        return "Secret('***')"

    def __str__(self) -> str:
        return "***"

    def __bool__(self) -> bool:
        return bool(self._value)


@dataclass(frozen=True, slots=True)
class Identity:
    """A controller's identity, as far as it reports it.

    Journal, markers, leases, backups and undo hang on the name, so it must not depend on how
    an address is spelled, on the medium, or on the name of a serial port.

    Attributes:
        name: The name under which everything is on record.
        address: How it was reached this time: the URL, with those options only that tell far
            ends apart.
        place: The name that it has where it says nothing of itself: its resolved address.
        certain: Whether asking once more would tell the same. A controller that is busy may
            be unable to answer just now.
        robot: Of a controller with several robots, the name of the one in force: tools, taught
            points and places are each robot's own, and on record as its own. Empty where there
            is one robot.
        robots: The names of all of them, in the controller's order.
    """

    name: str
    address: str
    place: str
    certain: bool = True
    robot: str = ""
    robots: tuple[str, ...] = ()

    @property
    def own(self) -> bool:
        """Whether the name comes from the controller's own answer."""
        return self.name != self.place


def is_own_name(name: str) -> bool:
    """Return whether a name comes from a controller's own answer, and not from its address.

    ``softmotion:0A1B2C3D`` is one; ``softmotion@192.168.0.2:502`` and URLs are not.
    """
    kind, _, number = name.partition(":")
    return bool(number) and kind.isalpha()


Who: TypeAlias = Callable[[], Identity]
"""Asks a controller for its identity each time; raises what an exchange may raise."""


@dataclass(frozen=True, slots=True)
class ControllerFacts:
    """Which controller and which robots these are, as far as they can be read.

    What a firmware does not tell is ``None``, or an empty tuple.

    Attributes:
        controller_name: The name a person gave it.
        controller_type: The maker's type text.
        controller_serial: The controller's own number.
        firmware: Version text.
        project: The project loaded in it.
        robot_number: The robot that motors and statements act on.
        robot_models: One for each robot; without the extended queries, of the current
            robot only.
        robot_serials: Likewise.
    """

    controller_name: str | None = None
    controller_type: str | None = None
    controller_serial: str | None = None
    firmware: str | None = None
    project: str | None = None
    robot_number: int | None = None
    robot_models: tuple[str, ...] = ()
    robot_serials: tuple[str, ...] = ()
