"""An input that the tip of a nozzle switches: a sensor, its delay and its scatter."""

import random
from collections.abc import Callable
from dataclasses import dataclass

from robolink.model import Pose, ToolOffset, rotate_xy
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import turned
from robolink_simulators.cell.places import Direction, XyzMm, axis_of
from robolink_simulators.cell.tip_switches import (
    STANDING,
    UPRIGHT,
    Lean,
    Shaft,
    Shake,
    TipSwitch,
    meets,
)
from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.kinematics import frame_of, tip_place
from robolink_simulators.epson.arm.robots import RobotModel


@dataclass(frozen=True, slots=True)
class Nozzle:
    """What is mounted.

    Attributes:
        tip: Where its tip is, seen from the flange.
        shaft: How it leans, in the flange's axes.
    """

    tip: ToolOffset | None
    shaft: Shaft


class TipInput:
    """Implements :data:`~robolink_simulators.epson.memory.input_bits.Sense`.

    Args:
        switch: What the tip meets.
        arm: Which carries the nozzle.
        nozzle: Tells what is mounted.
        beside: Tells where the switch meets a place of the base; it may have been moved.
        latency_s: How late the input follows.
        noise_mm: Standard deviation, per axis, of where it switches; drawn anew for each
            motion.
        rng: Source of that noise.
    """

    def __init__(
        self,
        switch: TipSwitch,
        arm: Arm,
        nozzle: Callable[[], Nozzle],
        *,
        beside: Callable[[TipSwitch, XyzMm], XyzMm],
        latency_s: float,
        noise_mm: float,
        rng: random.Random,
    ) -> None:
        self._switch = switch
        self._arm = arm
        self._nozzle = nozzle
        self._beside = beside
        self._latency_ns = round(latency_s * NS_PER_S)
        self._shake = Shake(noise_mm, rng)

    def __call__(self, instant_ns: int | None) -> bool:
        """Tell whether the input is on at an instant of the motion, ``None`` for now."""
        arm, nozzle = self._arm, self._nozzle()
        if instant_ns is None:
            flange = arm.true_flange()
        else:
            flange = arm.true_flange_at(instant_ns - self._latency_ns)
        x_mm, y_mm, z_mm = tip_place(arm.model, flange, nozzle.tip)
        dx_mm, dy_mm, dz_mm = self._shake.of(arm.moves_started)
        place = self._beside(self._switch, (x_mm + dx_mm, y_mm + dy_mm, z_mm + dz_mm))
        shaft = nozzle.shaft
        return meets(
            self._switch,
            place,
            _way(arm.model, flange, nozzle.tip, shaft.lean),
            bent_up_to_mm=shaft.bent_up_to_mm,
            upright=lambda: _way(arm.model, flange, nozzle.tip, UPRIGHT),
        )


def _way(model: RobotModel, flange: Pose, tip: ToolOffset | None, lean: Lean) -> Direction:
    """Return which way a shaft goes that leans, in base axes.

    A SCARA's flange looks up with its Z axis, so the shaft goes along it, less its lean; six axes
    look out of the flange, and the shaft comes back along the tool's own Z.
    """
    if not model.six_axes:
        if lean == UPRIGHT:
            return STANDING
        return (*rotate_xy(*lean, flange.u_deg), 1.0)
    x, y, z = axis_of(tip or ToolOffset(), "z")
    lean_x, lean_y = lean
    return turned(frame_of(flange).rotation, (lean_x - x, lean_y - y, -z))
