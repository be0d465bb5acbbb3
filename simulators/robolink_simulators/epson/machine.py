"""What SPEL+ statements act on: the robots of a controller, and the bits that all share."""

from collections.abc import Sequence
from functools import partial
from operator import attrgetter
from typing import Any

from robolink.model import Pose, ToolOffset
from robolink_simulators.device.wire_record import MotionLog
from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.motion_parameters import MotionParameters
from robolink_simulators.epson.arm.robot_settings import RobotSettings
from robolink_simulators.epson.arm.robots import Joints, RobotModel
from robolink_simulators.epson.camera_calibrations import ImageCalibrations
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.bits import IO_BITS, MEMORY_BITS, BitBank, IOLabel, TimedBits
from robolink_simulators.epson.memory.inputs import InputBits
from robolink_simulators.epson.memory.points import (
    ControlPoints,
    LocalTable,
    PalletTable,
    Point,
    PointTable,
)
from robolink_simulators.epson.memory.robot import DrivenRobot, KeptDefinitions
from robolink_simulators.epson.memory.tools import ToolMemory

REMOTE_ETHERNET = 26
"""CtrlDev of a controller run over Remote Ethernet (docs/reference/spel.md 9)."""


def _of_robot(name: str) -> Any:  # noqa: ANN401 - of the class that its annotation names
    """Return an attribute of the current robot; each statement asks for several."""
    return property(
        attrgetter(f"robot.{name}"),
        lambda machine, value: setattr(machine.robot, name, value),
    )


class Machine:
    """A controller's memory and its robots. No wire, no clock of its own.

    What belongs to one robot (arm, tools, points, settings ...) is that of the current robot:
    ``Robot n`` and SetCurRobot choose it (docs/reference/epson.md 1.5).

    Args:
        model: Which robot, number 1.
        joints: Where its arm stands; see :class:`Arm`.
        backlash_deg: See :class:`Arm`.
        serial: What RobotSerial$ gives of it; the controller's own number follows from it.
        others: Further robots, number 2 and on.
        io_bits: How many inputs there are, and how many outputs.

    Attributes:
        robots: All of them.
        motions: Those that any of them began, in order.
        robot_number: The one in force.
        robot: It.
        inputs: Input bits; the world sets them, or connects them to what the tip meets.
        outputs: Output bits.
        memory: Memory bits.
        timed_bits: Outputs and memory bits that switch back by themselves.
        io_labels: Names of inputs, outputs and memory bits, in lower case; part of the project.
        image_calibrations: Those of VxCalib.
        control_device: What CtrlDev gives.
    """

    model: RobotModel = _of_robot("model")
    serial: str = _of_robot("serial")
    arm: Arm = _of_robot("arm")
    tools: ToolMemory = _of_robot("tools")
    points: PointTable = _of_robot("points")
    locals: LocalTable = _of_robot("locals")
    parameters: MotionParameters = _of_robot("parameters")
    settings: RobotSettings = _of_robot("settings")
    pallets: PalletTable = _of_robot("pallets")
    control_points: ControlPoints = _of_robot("control_points")
    kept: KeptDefinitions = _of_robot("kept")
    sensed: bool = _of_robot("sensed")
    till_met: bool = _of_robot("till_met")
    found: Point | None = _of_robot("found")
    motors_on: bool = _of_robot("motors_on")
    power_high: bool = _of_robot("power_high")

    def __init__(
        self,
        model: RobotModel,
        *,
        joints: Joints | None = None,
        backlash_deg: float = 0.0,
        serial: str = "SIM00001",
        others: Sequence[RobotModel] = (),
        io_bits: int = IO_BITS,
    ) -> None:
        first = DrivenRobot(model, joints=joints, backlash_deg=backlash_deg, serial=serial)
        more = [
            DrivenRobot(other, serial=f"{serial}-{number}")
            for number, other in enumerate(others, start=2)
        ]
        self.robots = (first, *more)
        self.motions = MotionLog()
        for number, robot in enumerate(self.robots, start=1):
            robot.arm.on_started = partial(self.motions.add, robot=number)
        self.robot_number = 1
        self.inputs = InputBits(io_bits)
        for robot in self.robots:
            robot.latch.listen(self.inputs)
        self.outputs = BitBank(io_bits)
        self.memory = BitBank(
            MEMORY_BITS, no_bit=RefusalKind.MEMORY_BIT, no_byte=RefusalKind.MEMORY_BYTE
        )
        self.timed_bits = TimedBits()
        self.io_labels: dict[str, IOLabel] = {}
        self.image_calibrations = ImageCalibrations()
        self.control_device = REMOTE_ETHERNET

    @property
    def robot_number(self) -> int:
        """Number of the current robot."""
        return self._robot_number

    @robot_number.setter
    def robot_number(self, number: int) -> None:
        self._robot_number, self.robot = number, self.robots[number - 1]

    @property
    def moving(self) -> bool:
        """Whether any arm moves."""
        for robot in self.robots:  # noqa: SIM110 - a generator costs twice that, four times a poll
            if robot.arm.moving:
                return True
        return False

    def numbered(self, number: int) -> DrivenRobot:
        """Return a robot by its number.

        Raises:
            Refusal: There is no such robot.
        """
        if not 1 <= number <= len(self.robots):
            raise SpelRefusal(RefusalKind.ROBOT_NUMBER, f"There is no robot {number}")
        return self.robots[number - 1]

    def choose(self, number: int) -> None:
        """Make a robot the current one.

        Raises:
            Refusal: There is no such robot.
        """
        self.numbered(number)
        self.robot_number = number

    @property
    def controller_serial(self) -> str:
        """The serial number of the controller."""
        return f"C-{self.robots[0].serial}"

    @property
    def flash_writes(self) -> int:
        """How often TLSet or TLClr wrote the flash."""
        return sum(robot.tools.flash_writes for robot in self.robots)

    @property
    def offset(self) -> ToolOffset | None:
        """The definition of the selected tool, ``None`` for the flange."""
        return self.robot.offset

    def tip(self) -> Pose:
        """See :meth:`DrivenRobot.tip`."""
        return self.robot.tip()

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns`` for every arm."""
        for robot in self.robots:
            robot.arm.advance(now_ns)

    def halt(self, now_ns: int) -> None:
        """Stop every arm where it is."""
        for robot in self.robots:
            robot.arm.halt(now_ns)

    def keep_places(self, now_ns: int) -> None:
        """Stop every arm, and store where it is for Recover (documented for the safeguard)."""
        self.halt(now_ns)
        for robot in self.robots:
            robot.recovers_to = robot.arm.joints

    def switch_motors(self, on: bool) -> None:
        """Switch the motors of the current robot."""
        self.robot.switch_motors(on)

    def switch_all_motors(self, on: bool) -> None:
        """Switch the motors of every robot."""
        for robot in self.robots:
            robot.switch_motors(on)

    def clear_outputs(self) -> None:
        """Switch every output off, and forget which were to switch back."""
        self.outputs.clear()
        self.timed_bits.clear()

    def reset_motion_parameters(self) -> None:
        """Set the defaults and low power of every robot; see :class:`DrivenRobot`."""
        for robot in self.robots:
            robot.reset_motion_parameters()

    def forget_volatile(self, now_ns: int) -> None:
        """Forget what a power cycle clears; robot 1 is then current (assumed)."""
        for robot in self.robots:
            robot.forget_volatile(now_ns)
        self.robot_number = 1
        self.image_calibrations = ImageCalibrations()
        self.outputs.clear()
        self.memory.clear()
        self.timed_bits.clear()
