"""Jogging: each coordinate moves as long as exactly one of its two buttons is pressed."""

from collections.abc import Sequence
from dataclasses import dataclass

from robolink.model import AxisKind
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import (
    Frame,
    Matrix,
    Vector,
    about,
    add,
    dot,
    product,
    scale,
    turned,
)
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axes import Axis
from robolink_simulators.softmotion.group.paths import Dynamics, axes_for_tcp, require_inside
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisValues,
    CoordinateTransforms,
    CoordSystem,
    KinematicsModel,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

COORDINATES = 6

_STILL = 1e-12


@dataclass(frozen=True, slots=True)
class JogCommand:
    """The inputs of SMC_GroupJog2.

    Attributes:
        forward: Bit n: the button that moves coordinate n forward.
        backward: Bit n: the one that moves it back.
        system: ACS moves axes; the others the TCP along, and about, their axes.
        dynamics: In mm/s for X, Y, Z; factors of the axes' limits for ACS and for A, B, C.
    """

    forward: int
    backward: int
    system: CoordSystem
    dynamics: Dynamics

    @property
    def directions(self) -> tuple[int, ...]:
        """1, -1 or 0 a coordinate; both buttons at once are none (documented)."""
        return tuple((self.forward >> n & 1) - (self.backward >> n & 1) for n in range(COORDINATES))

    @property
    def by_factor(self) -> bool:
        """Whether its dynamics are factors."""
        return self.system is CoordSystem.ACS or any(self.directions[3:])


class JogMotion:
    """A jog in progress.

    Args:
        command: What is pressed at first.
        kinematics: Of the group.
        tool: Flange to TCP.
        transforms: Where the coordinate systems stand.
        axes: The drives.
        execution: What its block shows.

    Raises:
        Refused: A value of the command does not fit.
    """

    def __init__(
        self,
        command: JogCommand,
        kinematics: KinematicsModel,
        *,
        tool: Frame,
        transforms: CoordinateTransforms,
        axes: Sequence[Axis],
        execution: BlockExecution,
    ) -> None:
        self._kinematics = kinematics
        self._tool = tool
        self._transforms = transforms
        self._axes = axes
        self._velocities = [0.0] * COORDINATES
        self._configuration = kinematics.configuration(tuple(axis.value for axis in axes))
        self._command = command
        self.execution = execution
        self.press(command)
        execution.activate()

    @property
    def system(self) -> CoordSystem:
        """The coordinate system that the buttons count in."""
        return self._command.system

    @property
    def resting(self) -> bool:
        """Whether no button moves anything and nothing moves any more."""
        return not any(self._command.directions) and not any(self._velocities)

    def press(self, command: JogCommand) -> None:
        """Press other buttons.

        Raises:
            Refused: A value does not fit, or the coordinate system changes on the way.
        """
        command.dynamics.require_usable(*((1.0,) if command.by_factor else ()))
        if command.system is not self._command.system and any(self._velocities):
            raise BlockRefused(ErrorKind.PARAMETER, "The coordinate system cannot change in motion")
        if command.system is CoordSystem.ACS and any(command.directions[len(self._axes) :]):
            raise BlockRefused(ErrorKind.PARAMETER, f"There are only {len(self._axes)} axes")
        self._command = command

    def release(self) -> None:
        """Let go of all buttons."""
        system, dynamics = self._command.system, self._command.dynamics
        self._command = JogCommand(0, 0, system, dynamics)

    def step(self, values: AxisValues, cycle_ns: int) -> AxisValues:
        """Return the axes one cycle later; at a limit of a Cartesian jog, where they are.

        Raises:
            Refused: The TCP would leave the workspace.
        """
        seconds = cycle_ns / NS_PER_S
        self._take_up_speed(seconds)
        if self._command.system is CoordSystem.ACS:
            return self._step_axes(values, seconds)
        moved = self._moved(values, seconds)
        excess = max(
            abs(after - before) / (axis.limits.velocity_per_s * seconds)
            for axis, before, after in zip(self._axes, values, moved, strict=True)
        )
        return moved if excess <= 1 else self._moved(values, seconds / excess)

    def _step_axes(self, values: AxisValues, seconds: float) -> AxisValues:
        moved = []
        for n, (axis, value) in enumerate(zip(self._axes, values, strict=True)):
            wanted = value + self._velocities[n] * seconds
            inside = max(axis.limits.low, min(axis.limits.high, wanted))
            if inside != wanted:
                self._velocities[n] = 0.0
            moved.append(inside)
        return tuple(moved)

    def _moved(self, values: AxisValues, seconds: float) -> AxisValues:
        tcp = self._kinematics.flange(values) @ self._tool
        base = self._transforms.in_mcs(self._command.system, tcp).rotation
        ways = [velocity * seconds for velocity in self._velocities]
        tcp = jogged(tcp, base, (ways[0], ways[1], ways[2]), (ways[3], ways[4], ways[5]))
        moved = axes_for_tcp(self._kinematics, tcp, self._tool, self._configuration, near=values)
        require_inside(moved, self._axes)
        return moved

    def _take_up_speed(self, seconds: float) -> None:
        for n, direction in enumerate(self._command.directions):
            top, ramp, fall = self._limits(n)
            wanted, now = direction * top, self._velocities[n]
            change = (ramp if abs(wanted) > abs(now) else fall) * seconds
            now += max(-change, min(change, wanted - now))
            self._velocities[n] = 0.0 if abs(now) < _STILL else now

    def _limits(self, coordinate: int) -> tuple[float, float, float]:
        dynamics = self._command.dynamics
        if self._command.system is CoordSystem.ACS:
            if coordinate >= len(self._axes):
                return (0.0, 0.0, 0.0)
            driven = [self._axes[coordinate]]
        elif coordinate < 3:
            return (dynamics.velocity, dynamics.acceleration, dynamics.deceleration)
        else:
            driven = [axis for axis in self._axes if axis.kind is AxisKind.ROTARY]
        velocity = min((axis.limits.velocity_per_s for axis in driven), default=0.0)
        ramp = min((axis.limits.acceleration_per_s2 for axis in driven), default=0.0)
        return (
            velocity * dynamics.velocity,
            ramp * dynamics.acceleration,
            ramp * dynamics.deceleration,
        )


def jogged(tcp: Frame, base: Matrix, way_mm: Vector, turn_deg: Vector) -> Frame:
    """Return a TCP moved along, and turned about, the axes of a coordinate system.

    A, B and C turn about X, Y and Z through the TCP: they are no Euler angles here
    (documented, docs/reference/softmotion.md 2.3).

    Args:
        tcp: The TCP in MCS.
        base: Rotation of the coordinate system in MCS.
        way_mm: Way along its X, Y and Z.
        turn_deg: Turn about its X, Y and Z.
    """
    angle_deg = dot(turn_deg, turn_deg) ** 0.5
    rotation = tcp.rotation
    if angle_deg > 0:
        axis = turned(base, scale(turn_deg, 1 / angle_deg))
        rotation = product(about(axis, angle_deg), rotation)
    return Frame(add(tcp.shift_mm, turned(base, way_mm)), rotation)
