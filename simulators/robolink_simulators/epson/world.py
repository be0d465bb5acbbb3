"""The truth behind a simulated EPSON robot: where its tips really are, and who sees them."""

import random
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Any, Final

from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_simulators.cell.frames import Z_AXIS, Frame, about, product, turned
from robolink_simulators.cell.person import PersonLook as PersonLook
from robolink_simulators.cell.person import SimulatedOperator
from robolink_simulators.cell.places import Direction
from robolink_simulators.cell.tip_switches import TipSwitch
from robolink_simulators.cell.workplace import MOUNTED_TOOL as MOUNTED_TOOL
from robolink_simulators.cell.workplace import Workplace, XyzMm, exchanged, pin_beside
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.arm.arm import rest_of
from robolink_simulators.epson.arm.kinematics import (
    continued,
    forward,
    frame_of,
    pose_of_frame,
    tip_of,
    tip_place,
)
from robolink_simulators.epson.arm.robots import Joints, RobotModel
from robolink_simulators.epson.condition import OutOfReach
from robolink_simulators.epson.memory.bits import IO_BITS
from robolink_simulators.epson.memory.inputs import InputBits, Nozzle, TipInput
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.not_now import NotNowError

STORED: Final = ToolOffset(12.0, -3.5, -20.0)
"""Initial tool 1 in the controller: the nozzle mounted before."""

STORED_ON_SIX_AXES: Final = ToolOffset(12.0, -3.5, 120.0)
"""Initial tool 1 on a robot whose Tool 0 Z axis points out of the flange."""


def stored_on(model: RobotModel) -> ToolOffset:
    """Return the first value of tool 1 in a robot's controller."""
    return STORED_ON_SIX_AXES if model.six_axes else STORED


class World(Workplace):
    """Ground truth around an EPSON robot.

    Args:
        inputs: The inputs of its controller.
        robot: The robot in this world.
        tips: The physical tip of each tool number, seen from the flange.
        pin_mm: X, Y, Z of the tip of the reference pin, in base coordinates.
        seed: Decides the next nozzles and the errors of the eye.
        pendant_live: Whether the pendant may move the arm (Teach mode).
        now_ns: The simulated time.
        parameters: What goes wrong here.

    Attributes:
        operator: The person at the cell.
    """

    inputs = IO_BITS

    def __init__(
        self,
        inputs: InputBits,
        robot: DrivenRobot,
        tips: dict[int, ToolOffset],
        pin_mm: XyzMm,
        *,
        seed: int,
        pendant_live: Callable[[], bool],
        now_ns: Callable[[], int],
        parameters: WorldParameters | None = None,
    ) -> None:
        self.machine, self._inputs = robot, inputs  # wired below
        super().__init__(
            _HandledArm(robot, now_ns),
            tips,
            pin_mm,
            seed=seed,
            replaced=stored_on(robot.model),
            parameters=parameters or WorldParameters(),
        )
        robot.observer.resistance_n = self._resistance_n
        self.operator = PendantOperator(self, pendant_live=pendant_live, now_ns=now_ns, seed=seed)

    @classmethod
    def seeded(
        cls,
        inputs: InputBits,
        robot: DrivenRobot,
        seed: int,
        *,
        pendant_live: Callable[[], bool],
        now_ns: Callable[[], int],
        parameters: WorldParameters | None = None,
    ) -> "World":
        """Set up a nozzle change: tool 1 is stored and selected, but its tip is elsewhere.

        The arm is put where the physical tip stands some mm beside the pin and above it.
        """
        rng = random.Random(f"world {seed}")
        model, stored = robot.model, stored_on(robot.model)
        tips = {MOUNTED_TOOL: exchanged(stored, rng)}
        joints = rest_of(model)
        if not model.six_axes:
            joints = joints.at_height(0.4 * model.ranges[2].low)
        robot.arm.place(joints, 0)
        robot.tools.restore(
            {
                "selected": MOUNTED_TOOL,
                "offsets": {str(MOUNTED_TOOL): list(stored.components())},
                "flash_writes": 0,
            }
        )
        tip = tip_of(model, robot.arm.flange(), tips[MOUNTED_TOOL])
        pin_mm = pin_beside((tip.x_mm, tip.y_mm, tip.z_mm), rng)
        return cls(
            inputs,
            robot,
            tips,
            pin_mm,
            seed=seed,
            pendant_live=pendant_live,
            now_ns=now_ns,
            parameters=parameters,
        )

    def _resistance_n(self, joints: Joints) -> XyzMm:
        """Return the force on the mounted nozzle's tip, N, at joints without any play."""
        model = self.machine.arm.model
        tip_mm = tip_place(model, forward(model, joints), self.tips.get(MOUNTED_TOOL))
        return self.resistance_n(tip_mm)

    def connect(
        self,
        number: int,
        switch: TipSwitch,
        tool: int = MOUNTED_TOOL,
        *,
        latency_s: float = 0.0,
        noise_mm: float = 0.0,
    ) -> None:
        """Connect an input of the controller to a beam or a plate that the tip trips.

        Args:
            number: The input.
            switch: What the tip meets.
            tool: Whose tip.
            latency_s: How late the input follows.
            noise_mm: Standard deviation, per axis, of where it switches.
        """
        sense = TipInput(
            switch,
            self.machine.arm,
            lambda: Nozzle(self.tips.get(tool), self.shaft_of(tool)),
            beside=self.beside,
            latency_s=latency_s,
            noise_mm=noise_mm,
            rng=random.Random(f"input {number} {self._seed}"),
        )
        self._inputs.connect(number, sense)

    def disconnect(self, number: int) -> None:
        """Disconnect an input, which is then off."""
        self._inputs.set(number, on=False)

    def told_flange(self) -> Pose:
        """Return where the flange is as the base sees it."""
        return Pose(*self.machine.point_at(self.robot.flange()).coordinates)

    def truth(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        stored = self.machine.tools.defined()
        return {
            **super().truth(),
            "stored": {str(tool): asdict(offset) for tool, offset in stored.items()},
            "selected_tool": self.machine.tools.selected,
        }


class PendantOperator(SimulatedOperator):
    """The person at an EPSON cell, who jogs with the pendant and teaches points.

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
        super().__init__(world, require_jogging=self._require_pendant, seed=seed)
        self._machine = world.machine
        self._pendant_live = pendant_live
        self._now_ns = now_ns

    def teach_point(self, number: int, u_deg: float) -> Pose:
        """Turn the tool to ``u_deg``, jog its tip onto the pin, teach the flange pose there.

        As with Tool 0 selected on the pendant. Returns that pose.

        Raises:
            ConfigError: As :meth:`jog_onto_pin`.
            OutOfReach: The arm cannot get there.
        """
        self._require_pendant()
        arm = self._machine.arm
        there = replace(arm.flange(), u_deg=u_deg)
        arm.place(continued(arm.model, there, arm.joints), self._now_ns())
        flange = self.jog_onto_pin()
        self._machine.points.store(number, self._machine.point_at(flange))
        return flange

    def _require_pendant(self) -> None:
        if not self._pendant_live():
            raise NotNowError(
                tr("The pendant moves the arm in Teach mode only."),
                remedy=tr("Turn the mode selector to Teach first."),
            )


class _HandledArm:
    """Implements :class:`~robolink_simulators.cell.workplace.Handled`."""

    def __init__(self, machine: DrivenRobot, now_ns: Callable[[], int]) -> None:
        self._machine = machine
        self._now_ns = now_ns

    def placement(self) -> Hashable:
        return self._machine.arm.joints

    def flange(self) -> Pose:
        return self._machine.arm.flange()

    def tip_mm(self, tip: ToolOffset | None) -> XyzMm:
        arm = self._machine.arm
        met = tip_of(arm.model, arm.true_flange(), tip)
        return (met.x_mm, met.y_mm, met.z_mm)

    def turned(self, direction: Direction) -> Direction:
        return turned(frame_of(self._machine.arm.true_flange()).rotation, direction)

    def carry(self, tip: ToolOffset | None, by_mm: XyzMm) -> None:  # noqa: ARG002 - the orientation stays, so the flange goes as far as the tip
        arm = self._machine.arm
        flange = arm.flange()
        target = replace(
            flange,
            x_mm=flange.x_mm + by_mm[0],
            y_mm=flange.y_mm + by_mm[1],
            z_mm=flange.z_mm + by_mm[2],
        )
        arm.place(continued(arm.model, target, arm.joints), self._now_ns())

    def turn(self, by_deg: float) -> None:
        arm = self._machine.arm
        flange = arm.flange()
        if arm.model.six_axes:
            frame = frame_of(flange)
            there = Frame(frame.shift_mm, product(about(Z_AXIS, by_deg), frame.rotation))
            target = pose_of_frame(there, flange, tool=0)
        else:
            target = replace(flange, u_deg=flange.u_deg + by_deg)
        with suppress(OutOfReach):
            arm.place(continued(arm.model, target, arm.joints), self._now_ns())

    def loosen(self, parameters: WorldParameters) -> None:
        arm = self._machine.arm
        arm.backlash_deg, arm.backlash_mm = parameters.backlash_deg, parameters.backlash_mm
