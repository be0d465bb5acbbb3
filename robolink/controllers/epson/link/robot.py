"""Which robot the controller's statements act on."""

from dataclasses import dataclass

from robolink.controllers.epson.link.window import CommandWindow
from robolink.protocols import spel

_SIX_AXES = frozenset({5, 7})
"""RobotType 5 is the six-axis arm, 7 the N series (docs/reference/spel.md 9)."""


@dataclass(frozen=True, slots=True)
class Robot:
    """The robot in force: its number on the controller and its type code."""

    number: int
    type_code: int

    @property
    def six_axes(self) -> bool:
        """Whether V and W exist."""
        return self.type_code in _SIX_AXES


class RobotFacts:
    """Reads the robot once per session; one client at a time means it cannot change.

    Execute acts on the robot chosen with SetCurRobot (docs/reference/epson.md 1.5); robolink never
    changes that choice.
    """

    def __init__(self, window: CommandWindow) -> None:
        self._window = window
        self._robot: Robot | None = None

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
                kind = spel.parse_integer(self._window.printed(spel.print_robot_type()))
            self._robot = Robot(number, kind)
        return self._robot
