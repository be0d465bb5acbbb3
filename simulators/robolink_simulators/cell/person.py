"""The person at a simulated cell: looks at tool and tip, and jogs the tip onto the pin.

What they do otherwise than they should are their habits: :mod:`robolink_simulators.cell.habits`.
"""

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Final

from robolink.model import Pose
from robolink_simulators.cell.frames import add, subtract
from robolink_simulators.cell.habits import PersonManner, TouchCourse
from robolink_simulators.cell.places import Axis, XyzMm
from robolink_simulators.cell.workplace import MOUNTED_TOOL, Workplace
from robolink_simulators.device.wire_time import late_random

LAMP_MM: Final = 0.025
"""Distance in mm below the first contact at which a person who watches the lamp of a contact input
stops (assumed). They never stop above it.
"""


@dataclass(frozen=True, slots=True)
class PersonLook:
    """What a person sees: the vector from the physical tip to the pin, in base axes."""

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
        seed: Seed of the eye's errors and of the habits.
    """

    def __init__(
        self, workplace: Workplace, *, require_jogging: Callable[[], None], seed: int
    ) -> None:
        self._workplace = workplace
        self._require_jogging = require_jogging
        self._seed = seed
        self._random = late_random(f"operator {seed}")
        self._placement: tuple[Hashable, int] | None = None
        self._error = PersonLook(0.0, 0.0, 0.0)
        self._parameters = workplace.parameters
        self._habits = workplace.parameters.habits, workplace.parameters.bump
        self._course = TouchCourse(self._habits[0], late_random(f"habits {seed}"))
        self._manner: PersonManner | None = None
        self._left_at: tuple[Hashable, int] | None = None
        self._spot_mm: XyzMm | None = None

    @property
    def touches(self) -> int:
        """How many touches the person has begun since their habits were set."""
        return self._present_course().touches

    def begin_touch(self, tool: int | None = None) -> PersonManner:
        """Receive a request to touch the pin, and return how the person handles it.

        It is the next touch, unless the robot stands where the last one left it: then the same
        is asked for again.

        Args:
            tool: Whose tip; the nozzle on the arm by default.
        """
        tool = MOUNTED_TOOL if tool is None else tool
        course = self._present_course()
        if course.touches and self._left_at == (self._workplace.robot.placement(), tool):
            self._manner = course.resume()
        else:
            self._manner = self._begin_next(tool, asked=True)
        return self._manner

    def be_asked(self) -> PersonManner:
        """Receive another question, and return how the person handles it."""
        return PersonManner(self._workplace.parameters.person_thinks_s)

    def look(self, tool: int | None = None) -> PersonLook:
        """Return the vector from the tip to where the person wants it, with the eye's error.

        That is the pin, but for habits. Who only presses ENTER does not look, and sees no gap.

        Args:
            tool: Whose tip; the nozzle on the arm by default, whatever tool is selected.
        """
        tool = MOUNTED_TOOL if tool is None else tool
        self._present_course()
        if self._manner is None:  # no question came before, so this look begins the touch
            self._manner = self._begin_next(tool, asked=False)
        self._left_at = placement = (self._workplace.robot.placement(), tool)
        if placement != self._placement:
            self._placement = placement
            self._error = self._drawn_error()
        if self._manner.stays:
            return PersonLook(0.0, 0.0, 0.0)
        return PersonLook(*self._gap(tool))

    def way_along(self, axis: Axis, length_mm: float, tool: int | None = None) -> XyzMm:
        """Return, in base axes, a move along an axis of the tool, with the eye's error at its end.

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
        """Touch: jog until the eye sees no gap, and return the flange pose.

        The orientation stays, and so does all of it for a person who only presses ENTER.

        Raises:
            ConfigError: The person cannot jog now.
        """
        self._require_jogging()
        tool = MOUNTED_TOOL if tool is None else tool
        robot = self._workplace.robot
        self._manner = manner = self._begin_next(tool, asked=False)
        if not manner.stays:
            robot.turn(manner.turn_deg)
            self._error = self._drawn_error()
            robot.carry(self._workplace.tips.get(tool), self._gap(tool))
        self._placement = self._left_at = (robot.placement(), tool)
        return robot.flange()

    def _begin_next(self, tool: int, *, asked: bool) -> PersonManner:
        course, workplace = self._present_course(), self._workplace
        workplace.touch_begins(course.touches)
        self._left_at = (workplace.robot.placement(), tool)
        if workplace.surface is not None:
            # The spot nearest now: otherwise jogs along the axes would lead to another one.
            self._spot_mm = add(workplace.tip_mm(tool), workplace.gap_mm(tool))
        return course.begin(workplace.gap_mm(tool), asked=asked)

    def _present_course(self) -> TouchCourse:
        """Return the touches under the present habits; others begin a new count."""
        parameters = self._workplace.parameters
        if parameters is not self._parameters:  # what is set makes others: these never change
            self._parameters = parameters
            habits = parameters.habits, parameters.bump
            if habits != self._habits:
                self._habits = habits
                rng = late_random(f"habits {self._seed}")
                self._course = TouchCourse(parameters.habits, rng)
                self._manner = self._left_at = None
        return self._course

    def _gap(self, tool: int) -> XyzMm:
        error = self._error
        aim = self._course.aim_mm(self._workplace.robot.turned)
        gap = self._workplace.gap_mm(tool)
        if self._workplace.surface is not None and self._spot_mm is not None:
            gap = subtract(self._spot_mm, self._workplace.tip_mm(tool))
        wired = self._workplace.parameters.contact_input is not None and tool == MOUNTED_TOOL
        dz_mm = -abs(error.dz_mm) - LAMP_MM if wired else error.dz_mm
        return (
            gap[0] + aim[0] + error.dx_mm,
            gap[1] + aim[1] + error.dy_mm,
            gap[2] + aim[2] + dz_mm,
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
