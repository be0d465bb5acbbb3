"""The place where a simulated robot works, whatever its controller: tips, a pin, a person.

Ground truth. The controller knows none of it; only what it stores.
"""

import random
from collections.abc import Callable, Hashable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Protocol

from robolink.model import Pose, ToolOffset

XyzMm = tuple[float, float, float]
"""X, Y, Z in mm, in the robot's base frame."""

MOUNTED_TOOL: Final = 1
"""The tool number of the nozzle on the arm."""


class Handled(Protocol):
    """A robot as a person at the cell meets it."""

    def placement(self) -> Hashable:
        """Return a value that stays equal as long as the robot stands still."""

    def flange(self) -> Pose:
        """Return the commanded flange pose."""

    def tip_mm(self, tip: ToolOffset | None) -> XyzMm:
        """Return where a physical tip is, given where it sits on the flange."""

    def carry(self, tip: ToolOffset | None, by_mm: XyzMm) -> None:
        """Jog until the tip has moved that far; the flange turns as little as possible.

        What it cannot reach it refuses with the error of its own controller.
        """


class Workplace:
    """What is true around a robot.

    Args:
        robot: Who works here.
        tips: The physical tip of each tool number, seen from the flange.
        pin_mm: Tip of the reference pin.
        operator_sigma_mm: Standard deviation of what an eye reads, per axis.
        seed: Decides the next nozzles.
        replaced: What the next nozzle differs from where no tip is known yet.
    """

    def __init__(
        self,
        robot: Handled,
        tips: dict[int, ToolOffset],
        pin_mm: XyzMm,
        *,
        operator_sigma_mm: float = 0.01,
        seed: int,
        replaced: ToolOffset,
    ) -> None:
        self.robot = robot
        self.tips = tips
        self.pin_mm = pin_mm
        self.operator_sigma_mm = operator_sigma_mm
        self._random = random.Random(f"nozzles {seed}")
        self._replaced = replaced

    def tip_mm(self, tool: int = MOUNTED_TOOL) -> XyzMm:
        """Return where a physical tip is now."""
        return self.robot.tip_mm(self.tips.get(tool))

    def change_nozzle(self, tool: int = MOUNTED_TOOL) -> ToolOffset:
        """Put another nozzle on; its tip is some tenths of a mm from the old one's."""
        self.tips[tool] = exchanged(self.tips.get(tool, self._replaced), self._random)
        return self.tips[tool]

    def truth(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        return {
            "tips": {str(tool): asdict(tip) for tool, tip in self.tips.items()},
            "pin_mm": list(self.pin_mm),
            "operator_sigma_mm": self.operator_sigma_mm,
        }


@dataclass(frozen=True, slots=True)
class Look:
    """What an eye sees: the vector from the physical tip to the pin, in base axes."""

    dx_mm: float
    dy_mm: float
    dz_mm: float


class Operator:
    """A person at the cell: looks at the tip, and jogs it onto the pin.

    The eye errs by the same amount however often it looks at one placement of the arm; each
    new placement draws a new error.

    Args:
        workplace: What there is to see.
        require_jogging: Raises ConfigError where the person cannot jog.
        seed: Seed of the eye's errors.
    """

    def __init__(
        self, workplace: Workplace, *, require_jogging: Callable[[], None], seed: int
    ) -> None:
        self._workplace = workplace
        self._require_jogging = require_jogging
        self._random = random.Random(f"operator {seed}")
        self._placement: tuple[Hashable, int] | None = None
        self._error = Look(0.0, 0.0, 0.0)

    def look(self, tool: int | None = None) -> Look:
        """Return the vector from the tip to the pin, with the eye's error.

        Args:
            tool: Whose tip; the nozzle on the arm by default, whatever tool is selected.
        """
        tool = MOUNTED_TOOL if tool is None else tool
        placement = (self._workplace.robot.placement(), tool)
        if placement != self._placement:
            self._placement = placement
            self._error = self._drawn_error()
        dx, dy, dz = self._gap(tool)
        return Look(dx, dy, dz)

    def jog_onto_pin(self, tool: int | None = None) -> Pose:
        """Jog until the eye sees no gap; the orientation stays. Return the flange pose.

        Raises:
            ConfigError: The person cannot jog now.
        """
        self._require_jogging()
        tool = MOUNTED_TOOL if tool is None else tool
        robot = self._workplace.robot
        self._error = self._drawn_error()
        robot.carry(self._workplace.tips.get(tool), self._gap(tool))
        self._placement = (robot.placement(), tool)
        return robot.flange()

    def _gap(self, tool: int) -> XyzMm:
        pin, tip, error = self._workplace.pin_mm, self._workplace.tip_mm(tool), self._error
        return (
            pin[0] - tip[0] + error.dx_mm,
            pin[1] - tip[1] + error.dy_mm,
            pin[2] - tip[2] + error.dz_mm,
        )

    def _drawn_error(self) -> Look:
        sigma_mm = self._workplace.operator_sigma_mm
        return Look(*(self._random.gauss(0.0, sigma_mm) for _ in range(3)))


def exchanged(old: ToolOffset, rng: random.Random) -> ToolOffset:
    """Return where the tip of another nozzle sits: some tenths of a mm from the old one's."""
    x_mm, y_mm, z_mm = (_signed(rng, 0.2, 0.6) for _ in range(3))
    return replace(old, x_mm=old.x_mm + x_mm, y_mm=old.y_mm + y_mm, z_mm=old.z_mm + z_mm).rounded(4)


def pin_beside(tip_mm: XyzMm, rng: random.Random) -> XyzMm:
    """Return a pin some mm beside a tip and below it."""
    return (
        round(tip_mm[0] + _signed(rng, 5.0, 9.0), 3),
        round(tip_mm[1] + _signed(rng, 5.0, 9.0), 3),
        round(tip_mm[2] - rng.uniform(3.0, 6.0), 3),
    )


def _signed(rng: random.Random, low_mm: float, high_mm: float) -> float:
    return rng.choice((-1.0, 1.0)) * rng.uniform(low_mm, high_mm)
