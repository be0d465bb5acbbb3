"""What is left as it was before: power, speed, the arm at rest, no marker of what is over."""

from typing import Final

from robolink.errors import OutcomeUnknownError
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import MachineState, SentKind, SentRequest
from robolink_simulators.soak.rules.so_far import Grounds, chain

_AFTER_A_RESET: Final = (
    (0.0, 5.0, 5.0, 5.0, 50.0, 50.0, 50.0),
    (0.0, 5.0, 5.0, 5.0, 20.0, 20.0, 20.0),
)
"""What the machine itself sets, and what the driver holds it to before anything moves."""


class BeforeRules:
    """Looks at what a deed has to leave as it was.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check that no movement leaves while the arm of an unnumbered machine still moves."""
        if sent.kind is SentKind.MOVE and not self._on.plant.numbered:
            self._on.hold(
                "NothingMovesOn",
                not self._on.plant.moving,
                f"{sent.text} leaves process {process.number} while the arm moves",
            )

    def ended(self, process: VirtualProcess, error: BaseException | None) -> None:
        """Check a deed that ended by itself, with a link that answered to its end."""
        if process.cut_off or self._on.plant.calls_back:
            return
        # Whoever is told that nobody knows what a movement did looks at the robot.
        told = any(isinstance(one, OutcomeUnknownError) for one in chain(error))
        self._on.hold(
            "NothingMovesOn",
            told or not self._on.plant.moving,
            "nobody is connected, and the arm moves",
        )
        if error is None and self._on.books.trusted and not self._on.now.crowded:
            left = [
                marker.request
                for marker in self._on.books.markers()
                if marker.operation not in self._on.now.old_markers
            ]
            self._on.hold("NothingOutlives", not left, f"it ended well, and {left} is open")

    def left(self, state: MachineState) -> None:
        """Check what a deed left, before anybody acts."""
        plant, before = self._on.plant, self._on.now.before.settings
        robot = self._on.now.before.robot
        self._on.hold("AsBefore", state.robot == robot, f"robot {state.robot}, not {robot}")
        if plant.calls_back or plant.settings_reset:
            return
        self._on.hold(
            "AsBefore",
            state.settings == before
            or bool(self._on.open_selection())
            or not self._on.books.readable(),
            f"power and speeds are {state.settings}, they were {before}, and nothing says so",
        )

    def at_rest(self, state: MachineState) -> None:
        """Check the cell after its people have put it right: their reset may have changed it."""
        first = self._on.now.first.settings
        if self._on.plant.calls_back or not self._on.books.trusted:
            return
        self._on.hold(
            "AsBefore",
            state.settings == first
            or (self._on.plant.settings_reset and state.settings in _AFTER_A_RESET),
            f"power and speeds are {state.settings}, they were {first}",
        )
