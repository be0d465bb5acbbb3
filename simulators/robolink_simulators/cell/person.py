"""The person at a simulated cell: looks at tool and tip, and jogs the tip onto the pin."""

import math
import random
from collections.abc import Callable, Hashable
from dataclasses import dataclass

from robolink.model import Pose
from robolink_simulators.cell.places import Axis, XyzMm
from robolink_simulators.cell.workplace import MOUNTED_TOOL, Workplace


@dataclass(frozen=True, slots=True)
class PersonLook:
    """What an eye sees: the vector from the physical tip to the pin, in base axes."""

    dx_mm: float
    dy_mm: float
    dz_mm: float


class SimulatedOperator:
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
        self._error = PersonLook(0.0, 0.0, 0.0)

    def look(self, tool: int | None = None) -> PersonLook:
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
        return PersonLook(dx, dy, dz)

    def way_along(self, axis: Axis, length_mm: float, tool: int | None = None) -> XyzMm:
        """Return, in base axes, a way along an axis of the tool, with the eye's error at its end.

        Args:
            axis: Which one; the way goes to its positive side.
            length_mm: How long.
            tool: Whose; the nozzle on the arm by default.
        """
        x, y, z = self._workplace.axis(axis, MOUNTED_TOOL if tool is None else tool)
        error = self._drawn_error()
        return (
            length_mm * x + error.dx_mm,
            length_mm * y + error.dy_mm,
            length_mm * z + error.dz_mm,
        )

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

    def _drawn_error(self) -> PersonLook:
        rng, parameters = self._random, self._workplace.parameters
        sigma_mm = self._workplace.operator_sigma_mm
        dx, dy, dz = (rng.gauss(0.0, sigma_mm) for _ in range(3))
        if parameters.eye_outlier_share and rng.random() < parameters.eye_outlier_share:
            way = rng.uniform(0.0, math.tau)
            dx += parameters.eye_outlier_mm * math.cos(way)
            dy += parameters.eye_outlier_mm * math.sin(way)
        return PersonLook(dx, dy, dz)
