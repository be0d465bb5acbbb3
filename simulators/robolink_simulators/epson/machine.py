"""What SPEL+ statements touch: one robot, its tools, points, bits and settings."""

import random
from dataclasses import replace

from robolink.model import Pose, ToolOffset
from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.joints import Joints, check_ranges
from robolink_simulators.epson.arm.kinematics import (
    flange_of,
    forward,
    hand_of,
    posture_of,
    solve,
    tip_of,
)
from robolink_simulators.epson.arm.motion_parameters import MotionParameters
from robolink_simulators.epson.arm.robot_settings import RobotSettings
from robolink_simulators.epson.arm.robots import RobotModel
from robolink_simulators.epson.memory.bits import IO_BITS, MEMORY_BITS, BitBank
from robolink_simulators.epson.memory.input_bits import InputBits
from robolink_simulators.epson.memory.pallets import PalletTable
from robolink_simulators.epson.memory.points import LocalTable, Point, PointTable
from robolink_simulators.epson.memory.timed_bits import TimedBits
from robolink_simulators.epson.memory.tools import ToolMemory

REMOTE_ETHERNET = 26
"""CtrlDev of a controller run over Remote Ethernet (docs/reference/spel.md 9)."""


class Machine:
    """A controller's memory and its arm. No wire, no clock of its own.

    Args:
        model: Which robot.
        joints: Where the arm stands; see :class:`Arm`.
        backlash_deg: See :class:`Arm`.
        serial: What RobotSerial$ gives; the controller's own number follows from it.

    Attributes:
        arm: The arm in simulated time.
        tools: Tool definitions and the tool in force.
        points: P0 to P999.
        locals: Local coordinate systems.
        inputs: Input bits; the world sets them, or connects them to what the tip meets.
        outputs: Output bits.
        memory: Memory bits.
        parameters: Speeds, accelerations, LimZ.
        settings: What it is told about its load, its arm and its joints.
        pallets: Pallets 0 to 15.
        timed_bits: Outputs and memory bits that switch back by themselves.
        sensed: Whether the last Jump was stopped by its Sense.
        till_met: Whether the last motion was stopped by its Till.
        found: Where the last Find met its condition, the selected tool's tip.
        motors_on: Whether the motors are on.
        power_high: Whether power is high; low after anything that resets the parameters.
        robot_number: The robot in force; this controller has one.
        control_device: What CtrlDev gives.
    """

    def __init__(
        self,
        model: RobotModel,
        *,
        joints: Joints | None = None,
        backlash_deg: float = 0.0,
        serial: str = "SIM00001",
    ) -> None:
        self.model = model
        self.serial = serial
        self.arm = Arm(model, joints, backlash_deg=backlash_deg)
        self.tools = ToolMemory()
        self.points = PointTable()
        self.locals = LocalTable(tilting=model.six_axes)
        self.inputs = InputBits(IO_BITS)
        self.outputs = BitBank(IO_BITS)
        self.memory = BitBank(MEMORY_BITS)
        self.parameters = MotionParameters()
        self.settings = RobotSettings.of(model.axes)
        self.pallets = PalletTable()
        self.timed_bits = TimedBits()
        self.sensed = False
        self.till_met = False
        self.found: Point | None = None
        self.motors_on = False
        self.power_high = False
        self.robot_number = 1
        self.control_device = REMOTE_ETHERNET

    @property
    def controller_serial(self) -> str:
        """The serial number of the controller that drives it."""
        return f"C-{self.serial}"

    @property
    def flash_writes(self) -> int:
        """How often TLSet or TLClr wrote the flash."""
        return self.tools.flash_writes

    @property
    def offset(self) -> ToolOffset | None:
        """The definition of the tool in force, ``None`` for the flange."""
        return self.tools.get(self.tools.selected)

    def tip(self) -> Pose:
        """Return the commanded pose of the selected tool's tip (Here, CurPos)."""
        return self._tip_of(self.arm.flange())

    def real_tip(self, rng: random.Random, noise_mm: float) -> Pose:
        """Return the measured pose of the selected tool's tip (RealPos)."""
        return self._tip_of(self.arm.real_position(rng, noise_mm))

    def joints_for(self, target: Point) -> Joints:
        """Return the joints that bring the selected tool's tip to a point.

        Raises:
            Refusal: Its local is not defined, or the arm cannot take it up.
        """
        joints = self.solved(target)
        check_ranges(self.model, joints)
        return joints

    def solved(self, target: Point) -> Joints:
        """Return the joints of :meth:`joints_for`, whatever their ranges.

        Raises:
            Refusal: Its local is not defined, or the arm is too short.
        """
        flange = flange_of(self.model, self.pose_of(target), self.offset)
        return solve(self.model, flange, target.hand, target.posture)

    def flagged(self, target: Point, joints: Joints) -> Point:
        """Return a point with the flags of the joints that take it up."""
        hand, posture = hand_of(self.model, joints), posture_of(self.model, joints)
        return replace(target, hand=hand, posture=posture)

    def pose_of(self, target: Point) -> Pose:
        """Return where a point is in the base frame; on four axes without V and W.

        Raises:
            Refusal: Its local is not defined.
        """
        base = self.locals.to_base(target)
        x, y, z, u, v, w = base.coordinates
        if not self.model.six_axes:
            v = w = 0.0
        return Pose(x, y, z, u, v, w, hand=base.hand, posture=base.posture)

    def tip_at(self, joints: Joints) -> Pose:
        """Return where the selected tool's tip would be with other joints.

        Raises:
            OutOfReach: A joint would leave its range.
        """
        check_ranges(self.model, joints)
        return self._tip_of(forward(self.model, joints))

    def switch_motors(self, on: bool) -> None:
        """Switch the motors; on also resets the motion parameters (docs/reference/spel.md 6.3)."""
        self.motors_on = on
        if on:
            self.reset_motion_parameters()

    def clear_outputs(self) -> None:
        """Switch every output off, and forget which were to switch back."""
        self.outputs.clear()
        self.timed_bits.clear()

    def reset_motion_parameters(self) -> None:
        """Set the defaults and low power: start-up, Motor On, Reset and the like.

        Source: docs/reference/spel.md 6.3.
        """
        self.parameters = MotionParameters()
        self.power_high = False
        self.settings.reset()

    def _tip_of(self, flange: Pose) -> Pose:
        return tip_of(self.model, flange, self.offset, tool=self.tools.selected)
