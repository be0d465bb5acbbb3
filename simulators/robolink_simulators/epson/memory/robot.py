"""One robot of a controller: its arm, and what the controller stores for it alone."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final, Protocol

from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink_simulators.cell.frames import Frame
from robolink_simulators.epson.arm.arch import ArchTable
from robolink_simulators.epson.arm.areas import CheckedAreas, XYLimits
from robolink_simulators.epson.arm.arm import Arm, Travelled
from robolink_simulators.epson.arm.coordinate_systems import (
    AddedArms,
    Coordinates,
    RobotBase,
    frame_at,
)
from robolink_simulators.epson.arm.curves import CurveFiles
from robolink_simulators.epson.arm.joint_settings import (
    DriveSettings,
    JointOrigins,
    JointRanges,
    RestoredAt,
)
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
from robolink_simulators.epson.arm.robots import Joints, Range, RobotModel, check_ranges
from robolink_simulators.epson.arm.torque_limits import DriveGuard, TorqueLimits
from robolink_simulators.epson.arm.torques import CarriedLoad, DriveObserver
from robolink_simulators.epson.memory.inputs import PositionLatch
from robolink_simulators.epson.memory.points import (
    ControlPoints,
    LocalTable,
    PalletTable,
    Point,
    PointTable,
)
from robolink_simulators.epson.memory.tools import ToolMemory


class KeptDefinitions:
    """What one robot retains over a power cycle, except for its tools.

    Args:
        own_arm: The values of arm 0, as ArmSet lists them.
        ranges: Those of the joints.
        base: Where its base stands.
        origins: Where the zeros of its joints lie.

    Attributes:
        arches: Those of Jump.
        arms: Added arms; that they are kept as tools are is assumed.
        areas: Boxes and planes that are checked.
        curves: The files of Curve.
        limits: Those of XYLim; that they are kept is assumed, their mode is not (documented).
        ranges: Those of the joints.
        base: Where its base stands; SysConfig saves it (documented).
        origins: Where the zeros of its joints lie (documented that they are kept).
    """

    def __init__(
        self, own_arm: Sequence[float], ranges: JointRanges, base: RobotBase, origins: JointOrigins
    ) -> None:
        self.arches = ArchTable()
        self.arms = AddedArms(own_arm)
        self.areas = CheckedAreas()
        self.curves = CurveFiles()
        self.limits = XYLimits()
        self.ranges = ranges
        self.base = base
        self.origins = origins

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {name: getattr(self, name).to_state() for name in _KEPT}

    def restore(self, state: Mapping[str, object]) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        for name in _KEPT:
            if name in state or name in _KEPT_FROM_THE_START:
                getattr(self, name).restore(state[name])


_KEPT_FROM_THE_START: Final = ("arches", "arms", "curves", "limits")
"""Parts that every state file has."""

_KEPT: Final = ("arches", "arms", "areas", "curves", "limits", "ranges", "base", "origins")


class ReservedMotion(Protocol):
    """A motion that waits for SyncRobots (docs/reference/spel.md 7.1)."""

    @property
    def stands(self) -> bool:
        """Whether its giver still waits for it."""
        ...

    def start_reserved(self, now_ns: int) -> None:
        """Begin it at an instant, with its robot current."""
        ...


class DrivenRobot:
    """A robot: arm, tools, points, locals, pallets, settings, motors and power.

    Args:
        model: Which robot.
        joints: Where the arm stands; see :class:`Arm`.
        backlash_deg: See :class:`Arm`.
        serial: What RobotSerial$ gives.

    Attributes:
        arm: The arm in simulated time.
        tools: Tool definitions and the selected tool.
        points: P0 to P999.
        locals: Local coordinate systems.
        parameters: Speeds, accelerations, LimZ.
        settings: What it is told about its load, its arm and its joints.
        pallets: Pallets 0 to 15.
        control_points: External control points 1 to 15.
        kept: What it was told once and keeps, but for tools.
        drives: Settings of its drives.
        observer: What is measured of its drives.
        guard: What stops them.
        sensed: Whether the last Jump was stopped by its Sense.
        till_met: Whether the last motion was stopped by its Till.
        found: Where the last Find met its condition, the selected tool's tip.
        motors_on: Whether the motors are on.
        power_high: Whether power is high; low after anything that resets the parameters.
        jump: When the last Jump began, and how long its three parts were to take, in ns.
        recovers_to: Where it was when the safeguard opened, until it goes back there.
        way_back: Which of its motions leads back there, ``None`` before the first.
        latch: Takes its position at edges of an input.
        reservation: The motion that waits for SyncRobots, if whoever gave it still does.
        opened_brakes: Joints whose brake was opened by hand while the motors are off.
    """

    def __init__(
        self,
        model: RobotModel,
        *,
        joints: Joints | None = None,
        backlash_deg: float = 0.0,
        serial: str,
    ) -> None:
        self.serial = serial
        self.arm = Arm(model, joints, backlash_deg=backlash_deg)
        self.tools = ToolMemory()
        self.points = PointTable()
        self.locals = LocalTable(tilting=model.six_axes)
        self.parameters = MotionParameters()
        self.settings = RobotSettings.of(model.axes)
        self.pallets = PalletTable()
        self.control_points = ControlPoints()
        ranges = JointRanges(model.ranges, model.pulses_per_unit)
        base = RobotBase(tilting=model.six_axes)
        origins = JointOrigins(model.pulses_per_unit)
        self.kept = KeptDefinitions(model.arm_values, ranges, base, origins)
        self.opened_brakes = set[int]()
        self.reservation: ReservedMotion | None = None
        self.latch = PositionLatch(self.arm)
        self.jump: tuple[int, tuple[int, ...]] | None = None
        self.recovers_to: Joints | None = None
        self.way_back: int | None = None
        self.drives = DriveSettings(model.axes)
        limits = TorqueLimits(lambda: self.drives, lambda: self.power_high)
        self.observer = DriveObserver(self.arm, self._load, limits.shares)
        self.guard = DriveGuard(self.observer, limits.limits)
        self.arm.guard, self.arm.on_travelled = self.guard.cut, self._travelled
        self.sensed = False
        self.till_met = False
        self.found: Point | None = None
        self.motors_on = False
        self._motors_on_ns = self._motors_since_ns = 0
        self.power_high = False

    @property
    def model(self) -> RobotModel:
        """The robot's model, with the present arm and its joint ranges."""
        arms = self.kept.arms
        return (
            self.arm.model.with_arm(arms.values(arms.selected)) if arms.selected else self.arm.model
        )

    @property
    def recovering(self) -> bool:
        """Whether it is moving back to where the safeguard stopped it."""
        return self.arm.moving and self.arm.moves_started == self.way_back

    def put_in_force(self, number: int) -> None:
        """Select an arm: all places count for it from then on.

        Raises:
            Refusal: It is not defined, or has none of that number.
        """
        self.kept.arms.select(number)
        self.take_up_kept()

    @property
    def hand(self) -> Hand:
        """The present hand of the selected arm."""
        return hand_of(self.model, self.arm.joints)

    @property
    def posture(self) -> Posture | None:
        """The present elbow, wrist and flags of the selected arm, ``None`` if it has none."""
        return posture_of(self.model, self.arm.joints)

    def _load(self) -> CarriedLoad:
        return CarriedLoad(self.settings.weight_kg, self.settings.inertia_kg_m2)

    def _travelled(self, travelled: Travelled) -> None:
        self.observer.take(travelled)
        self.guard.ended(complete=travelled.complete)

    @property
    def reserved(self) -> ReservedMotion | None:
        """The motion that waits for SyncRobots."""
        motion = self.reservation
        return motion if motion is not None and motion.stands else None

    def take_up_kept(self) -> None:
        """Apply the restored arm, ranges and zeros of the joints."""
        self.arm.added_in_force = self.kept.arms.selected != 0
        self.hold_to_ranges()
        self.arm.origin_errors = self.kept.origins.errors

    def offset_origins(self, offsets: Sequence[int]) -> None:
        """Set other zeros of the joints: the arm stays, the controller believes it elsewhere.

        Raises:
            OutOfReach: A joint would stand outside its range.
        """
        origins, scales = self.kept.origins, self.model.pulses_per_unit
        rows = zip(self.arm.joints, origins.offsets, offsets, scales, strict=True)
        joints = Joints(*(at + (new - old) / scale for at, old, new, scale in rows))
        self.arm.tell_elsewhere(joints)
        origins.offsets = tuple(offsets)
        self.arm.origin_errors = origins.errors

    @property
    def at_home(self) -> bool:
        """Whether it is at HomeSet."""
        scales = zip(self.arm.joints, self.model.pulses_per_unit, strict=True)
        home = self.settings.home_pulses
        return home is not None and list(home) == [round(at * scale) for at, scale in scales]

    @property
    def brakes_closed(self) -> tuple[bool, ...]:
        """Whether the brake of each of six joints is closed: all while the motors are off."""
        joints = range(1, self.model.axes + 1)
        return tuple(not self.motors_on and joint not in self.opened_brakes for joint in joints)

    @property
    def motors_on_ns(self) -> int:
        """How long the motors have been on since the simulation began."""
        since_ns = self._motors_since_ns
        return self._motors_on_ns + (self.arm.now_ns - since_ns if self.motors_on else 0)

    def hold_to_ranges(self) -> None:
        """Apply the given ranges of the joints."""
        ranges = tuple(Range(*ends) for ends in self.kept.ranges.ends)
        self.arm.model = replace(self.arm.model, ranges=ranges)

    @property
    def offset(self) -> ToolOffset | None:
        """The definition of the selected tool, ``None`` for the flange."""
        return self.tools.get(self.tools.selected)

    def tip(self) -> Pose:
        """Return the commanded pose of the selected tool's tip (Here, CurPos)."""
        return self._tip_of(forward(self.model, self.arm.joints))

    def real_tip(self, rng: random.Random, noise_mm: float) -> Pose:
        """Return the measured pose of the selected tool's tip (RealPos)."""
        return self._tip_of(self.arm.real_position(rng, noise_mm, self.model))

    def tip_at(self, joints: Joints) -> Pose:
        """Return where the selected tool's tip would be with other joints.

        Raises:
            OutOfReach: A joint would leave its range.
        """
        check_ranges(self.model, joints)
        return self._tip_of(forward(self.model, joints))

    def tip_near(self, joints: Joints) -> Pose:
        """Return where the selected tool's tip would be with joints, whatever their ranges."""
        return self._tip_of(forward(self.model, joints))

    def tip_on_the_way(self, instant_ns: int | None) -> Pose:
        """Return the tip at an instant of the motion in progress, or for ``None`` at present."""
        if instant_ns is None:
            return self.tip()
        return self._tip_of(forward(self.model, self.arm.position_at(instant_ns)))

    def joints_for(self, target: Point) -> Joints:
        """Return the joints that move the selected tool's tip to a point.

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
        """Return where the robot sees a point; on four axes without V and W.

        Raises:
            Refusal: Its local is not defined.
        """
        base = self.locals.to_base(target)
        x, y, z, u, v, w = self.kept.base.to_robot(base.coordinates)
        if not self.model.six_axes:
            v = w = 0.0
        return Pose(x, y, z, u, v, w, hand=base.hand, posture=base.posture)

    def point_at(self, pose: Pose) -> Point:
        """Return the point of a pose that the robot sees, as its base sees it."""
        at, base = Point.at(pose), self.kept.base
        return replace(at, coordinates=base.to_base(at.coordinates)) if base.moved else at

    def here(self) -> Point:
        """Return the commanded place of the selected tool's tip."""
        return self.point_at(self.tip())

    def control_point(self, number: int) -> Frame:
        """Return where the robot sees an external control point; its place counts from the base.

        Raises:
            Refusal: It is not defined.
        """
        return frame_at(self.kept.base.to_robot(self.control_points.get(number)))

    def move_base(self, coordinates: Coordinates) -> None:
        """Move the base: every local has to be defined anew (documented).

        Raises:
            Refusal: The robot cannot have such a base.
        """
        if self.kept.base.move(coordinates):
            self.locals.clear_all()

    def switch_motors(self, on: bool) -> None:
        """Switch the motors; on also resets the motion parameters (docs/reference/spel.md 6.3)."""
        self._motors_on_ns, self._motors_since_ns = self.motors_on_ns, self.arm.now_ns
        self.motors_on = on
        self.opened_brakes.clear()
        if on:
            self.drives.put_back(RestoredAt.DRIVES)
            self.reset_motion_parameters()

    def reset_motion_parameters(self) -> None:
        """Set the defaults and low power: start-up, Motor On, Reset and the like.

        Source: docs/reference/spel.md 6.3.
        """
        self.parameters = MotionParameters()
        self.power_high = False
        self.settings.reset()
        self.drives.put_back(RestoredAt.FIVE)

    def forget_volatile(self, now_ns: int) -> None:
        """Forget what a power cycle clears: all but tools, HomeSet and its place."""
        self.arm.halt(now_ns)
        self.reservation = None
        self.observer.forget()
        self.latch.forget()
        self.jump = self.recovers_to = None
        self.switch_motors(False)
        self.reset_motion_parameters()
        home, order = self.settings.home_pulses, self.settings.home_order
        self.settings = RobotSettings.of(self.model.axes)
        self.settings.home_pulses, self.settings.home_order = home, order
        self.points = PointTable()
        self.locals = LocalTable(tilting=self.model.six_axes)
        self.drives = DriveSettings(self.model.axes)
        self.control_points.selected = 0
        self.kept.limits.strict = False

    def _tip_of(self, flange: Pose) -> Pose:
        return tip_of(self.model, flange, self.offset, tool=self.tools.selected)
