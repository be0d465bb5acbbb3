"""The truth behind a simulated robot: where its tips really are, and who looks at them."""

import random
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_simulators.epson.kinematics import Joints, inverse, tip_of
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.points import Point

STORED: Final = ToolOffset(12.0, -3.5, -20.0)
"""What the controller holds for tool 1 at first: the nozzle that was there before."""

MOUNTED_TOOL: Final = 1
"""The tool number of the nozzle on the arm."""


class World:
    """Ground truth. The controller knows none of it; only what it stores.

    Args:
        machine: The robot in this world.
        tips: The physical tip of each tool number, seen from the flange.
        pin_mm: X, Y, Z of the tip of the reference pin, in base coordinates.
        operator_sigma_mm: Standard deviation of what an eye reads, per axis.
        seed: Decides the next nozzles and the errors of the eye.
        pendant_live: Whether the pendant may move the arm (Teach mode).
        now_ns: The simulated time.

    Attributes:
        operator: The person at the cell.
    """

    def __init__(
        self,
        machine: Machine,
        tips: dict[int, ToolOffset],
        pin_mm: tuple[float, float, float],
        *,
        operator_sigma_mm: float = 0.01,
        seed: int,
        pendant_live: Callable[[], bool],
        now_ns: Callable[[], int],
    ) -> None:
        self.machine = machine
        self.tips = tips
        self.pin_mm = pin_mm
        self.operator_sigma_mm = operator_sigma_mm
        self._random = random.Random(f"nozzles {seed}")
        self.operator = Operator(self, pendant_live=pendant_live, now_ns=now_ns, seed=seed)

    @classmethod
    def seeded(
        cls,
        machine: Machine,
        seed: int,
        *,
        pendant_live: Callable[[], bool],
        now_ns: Callable[[], int],
    ) -> "World":
        """Set up a nozzle change: tool 1 is stored and selected, but its tip is elsewhere.

        The arm is put where the physical tip stands some mm beside the pin and above it.
        """
        rng = random.Random(f"world {seed}")
        tips = {MOUNTED_TOOL: _exchanged(STORED, rng)}
        stroke_mm = -machine.model.ranges[2].low
        machine.arm.place(Joints(45.0, 60.0, -0.4 * stroke_mm, -105.0), 0)
        machine.tools.restore(
            {
                "selected": MOUNTED_TOOL,
                "offsets": {str(MOUNTED_TOOL): list(STORED.components())},
                "flash_writes": 0,
            }
        )
        tip = tip_of(machine.arm.flange(), tips[MOUNTED_TOOL])
        pin_mm = (
            round(tip.x_mm + _signed(rng, 5.0, 9.0), 3),
            round(tip.y_mm + _signed(rng, 5.0, 9.0), 3),
            round(tip.z_mm - rng.uniform(3.0, 6.0), 3),
        )
        return cls(machine, tips, pin_mm, seed=seed, pendant_live=pendant_live, now_ns=now_ns)

    def tip_mm(self, tool: int = MOUNTED_TOOL) -> tuple[float, float, float]:
        """Return where a physical tip is now, in base coordinates."""
        tip = tip_of(self.machine.arm.true_flange(), self.tips.get(tool))
        return (tip.x_mm, tip.y_mm, tip.z_mm)

    def change_nozzle(self, tool: int = MOUNTED_TOOL) -> ToolOffset:
        """Put another nozzle on; its tip is some tenths of a mm from the old one's."""
        self.tips[tool] = _exchanged(self.tips.get(tool, STORED), self._random)
        return self.tips[tool]

    def truth(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        stored = self.machine.tools.defined()
        return {
            "tips": {str(tool): asdict(tip) for tool, tip in self.tips.items()},
            "stored": {str(tool): asdict(offset) for tool, offset in stored.items()},
            "selected_tool": self.machine.tools.selected,
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
    """A person at the cell: looks at the tip, and jogs it onto the pin with the pendant.

    The eye errs by the same amount however often it looks at one placement of the arm; each
    new placement draws a new error.

    Args:
        world: What there is to see.
        pendant_live: Whether the pendant may move the arm (Teach mode).
        now_ns: The simulated time.
        seed: Seed of the eye's errors.
    """

    def __init__(
        self,
        world: World,
        *,
        pendant_live: Callable[[], bool],
        now_ns: Callable[[], int],
        seed: int,
    ) -> None:
        self._world = world
        self._pendant_live = pendant_live
        self._now_ns = now_ns
        self._random = random.Random(f"operator {seed}")
        self._placement: tuple[Joints, int] | None = None
        self._error = Look(0.0, 0.0, 0.0)

    def look(self, tool: int | None = None) -> Look:
        """Return the vector from the tip to the pin, with the eye's error.

        Args:
            tool: Whose tip; the nozzle on the arm by default, whatever tool is selected.
        """
        tool = MOUNTED_TOOL if tool is None else tool
        self._take_up_position(tool)
        gap = zip(self._world.pin_mm, self._world.tip_mm(tool), strict=True)
        dx, dy, dz = (pin - tip for pin, tip in gap)
        error = self._error
        return Look(dx + error.dx_mm, dy + error.dy_mm, dz + error.dz_mm)

    def jog_onto_pin(self, tool: int | None = None) -> Pose:
        """Jog until the eye sees no gap; U stays. Return the flange pose.

        Raises:
            ConfigError: The controller is not in Teach mode, so the pendant moves nothing.
            OutOfReach: The arm cannot get there.
        """
        self._require_pendant()
        tool = MOUNTED_TOOL if tool is None else tool
        arm = self._world.machine.arm
        self._error = self._drawn_error()
        pin_x, pin_y, pin_z = self._world.pin_mm
        tip_x, tip_y, tip_z = self._world.tip_mm(tool)
        flange = arm.flange()
        target = replace(
            flange,
            x_mm=flange.x_mm + pin_x - tip_x + self._error.dx_mm,
            y_mm=flange.y_mm + pin_y - tip_y + self._error.dy_mm,
            z_mm=flange.z_mm + pin_z - tip_z + self._error.dz_mm,
        )
        arm.place(inverse(arm.model, target, arm.hand), self._now_ns())
        self._placement = (arm.joints, tool)
        return arm.flange()

    def teach_point(self, number: int, u_deg: float) -> Pose:
        """Turn the tool to ``u_deg``, jog its tip onto the pin, teach the flange pose there.

        As with Tool 0 selected on the pendant. Returns that pose.

        Raises:
            ConfigError: As :meth:`jog_onto_pin`.
            OutOfReach: The arm cannot get there.
        """
        self._require_pendant()
        arm = self._world.machine.arm
        turned = replace(arm.flange(), u_deg=u_deg)
        arm.place(inverse(arm.model, turned, arm.hand), self._now_ns())
        flange = self.jog_onto_pin()
        self._world.machine.points.store(number, Point.at(flange))
        return flange

    def _require_pendant(self) -> None:
        if not self._pendant_live():
            raise ConfigError(
                tr("The pendant moves the arm in Teach mode only."),
                remedy=tr("Turn the mode selector to Teach first."),
            )

    def _take_up_position(self, tool: int) -> None:
        placement = (self._world.machine.arm.joints, tool)
        if placement != self._placement:
            self._placement = placement
            self._error = self._drawn_error()

    def _drawn_error(self) -> Look:
        sigma_mm = self._world.operator_sigma_mm
        return Look(*(self._random.gauss(0.0, sigma_mm) for _ in range(3)))


def _exchanged(old: ToolOffset, rng: random.Random) -> ToolOffset:
    x_mm, y_mm, z_mm = (_signed(rng, 0.2, 0.6) for _ in range(3))
    return replace(old, x_mm=old.x_mm + x_mm, y_mm=old.y_mm + y_mm, z_mm=old.z_mm + z_mm).rounded(4)


def _signed(rng: random.Random, low_mm: float, high_mm: float) -> float:
    return rng.choice((-1.0, 1.0)) * rng.uniform(low_mm, high_mm)
