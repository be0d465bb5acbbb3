"""The paths of a movement, as functions of the share covered."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from robolink.model import AxisKind
from robolink_simulators.cell.frames import (
    ORIGIN,
    Frame,
    Matrix,
    Vector,
    about,
    add,
    axis_and_angle,
    product,
    scale,
    subtract,
    transposed,
    turned,
)
from robolink_simulators.softmotion.group.axes import Axis
from robolink_simulators.softmotion.group.profile import Pace
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    CoordinateTransforms,
    CoordRef,
    CoordSystem,
    KinematicsModel,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_STILL = 1e-9
_LEAST_DYNAMICS = 1e-9
_CHECK_EVERY_MM = 2.0
_CHECK_EVERY_DEG = 2.0
_MOST_CHECKS = 500


class Dynamics(NamedTuple):
    """The limits of a movement's dynamics.

    In mm/s, mm/s2, mm/s2 and mm/s3 on a line; factors above 0 up to 1 of what the axes can do
    in a direct movement. The jerk is checked and plays no part (see :mod:`.profile`).
    """

    velocity: float
    acceleration: float
    deceleration: float
    jerk: float

    def require_usable(self, most: float = math.inf) -> None:
        """Refuse values that are not finite, not positive or above ``most``.

        So are those next to 0 (assumed): no clock shows when such a movement would arrive.

        Raises:
            Refused: Names the value.
        """
        for name, value in self._asdict().items():
            if not (math.isfinite(value) and _LEAST_DYNAMICS <= value <= most):
                raise BlockRefused(ErrorKind.DYNAMICS, f"{name} cannot be {value}")


@dataclass(frozen=True, slots=True)
class JointPath:
    """Straight in axis space; all axes start and stop together."""

    start: AxisValues
    end: AxisValues

    def axes_at(self, share: float) -> AxisValues:
        """Return the axes after a share of the path."""
        if share >= 1:
            return self.end
        return tuple(a + (b - a) * share for a, b in zip(self.start, self.end, strict=True))

    def axes_in_corner(self, share: float, before: AxisValues) -> AxisValues:
        """Return the axes while the movement before has yet to arrive where this one begins."""
        mine = self.axes_at(share)
        return tuple(b + m - c for b, m, c in zip(before, mine, self.start, strict=True))


@dataclass(frozen=True, slots=True)
class LinePath:
    """The TCP on a straight line in MCS, its orientation turning evenly about one axis.

    Attributes:
        kinematics: Of the group.
        tool: Flange to TCP; the selected tool when the movement was commanded.
        configuration: Kept all along.
        start: Axes at its beginning.
        end: Axes at its end.
        start_tcp: TCP at its beginning.
        end_tcp: TCP at its end.
    """

    kinematics: KinematicsModel
    tool: Frame
    configuration: Configuration
    start: AxisValues
    end: AxisValues
    start_tcp: Frame
    end_tcp: Frame
    _way: Vector = field(init=False, repr=False, compare=False)
    _turn: tuple[Vector, float] = field(init=False, repr=False, compare=False)
    _unturned: Matrix = field(init=False, repr=False, compare=False)
    _axes: JointPath = field(init=False, repr=False, compare=False)
    _unturned_flange: Matrix | None = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # A movement evaluates its path in every cycle.
        a, b = self.start_tcp, self.end_tcp
        axis, angle_deg = axis_and_angle(product(b.rotation, transposed(a.rotation)))
        object.__setattr__(self, "_way", subtract(b.shift_mm, a.shift_mm))
        object.__setattr__(self, "_turn", (axis, angle_deg))
        object.__setattr__(self, "_unturned", product(about(axis, 0.0), a.rotation))
        object.__setattr__(self, "_axes", JointPath(self.start, self.end))
        object.__setattr__(self, "_unturned_flange", None)

    def tcp_at(self, share: float) -> Frame:
        """Return the TCP after a share of the path."""
        a, (axis, angle_deg) = self.start_tcp, self._turn
        part = self._unturned
        if angle_deg:
            part = product(about(axis, angle_deg * share), a.rotation)
        return Frame(add(a.shift_mm, scale(self._way, share)), part)

    def axes_at(self, share: float) -> AxisValues:
        """Return the axes after a share of the path."""
        return self.end if share >= 1 else self._axes_for(self.tcp_at(share), share)

    def axes_in_corner(self, share: float, before: AxisValues) -> AxisValues:
        """Return the axes while the movement before has yet to arrive where this one begins."""
        mine, tcp = self.tcp_at(share), self.kinematics.flange(before) @ self.tool
        shift = add(tcp.shift_mm, subtract(mine.shift_mm, self.start_tcp.shift_mm))
        turn = product(mine.rotation, transposed(self.start_tcp.rotation))
        return self._axes_for(Frame(shift, product(turn, tcp.rotation)), share)

    @property
    def length_mm(self) -> float:
        """Path length of the TCP."""
        return math.dist(self.start_tcp.shift_mm, self.end_tcp.shift_mm)

    @property
    def turn_deg(self) -> float:
        """How far the orientation turns."""
        return self._turn[1]

    def _axes_for(self, tcp: Frame, share: float) -> AxisValues:
        near = self._axes.axes_at(share)
        rotation = self._flange_rotation(tcp)
        return _axes_for(self.kinematics, tcp, self.tool, rotation, self.configuration, near=near)

    def _flange_rotation(self, tcp: Frame) -> Matrix:
        """Return how the flange stands; where the TCP does not turn it is asked for once."""
        if tcp.rotation is not self._unturned:
            return flange_rotation(self.kinematics, tcp, self.tool)
        found = self._unturned_flange
        if found is None:
            found = flange_rotation(self.kinematics, tcp, self.tool)
            object.__setattr__(self, "_unturned_flange", found)
        return found


Path = JointPath | LinePath


def flange_rotation(kinematics: KinematicsModel, tcp: Frame, tool: Frame) -> Matrix:
    """Return the flange's orientation that brings the TCP's as close as possible.

    Raises:
        Refused: No orientation is closest.
    """
    wanted = product(tcp.rotation, transposed(tool.rotation))
    image = kinematics.orientation_image(wanted)
    return wanted if image is None else image.m_ori_zero


def axes_for_tcp(
    kinematics: KinematicsModel,
    tcp: Frame,
    tool: Frame,
    configuration: Configuration,
    *,
    near: AxisValues,
) -> AxisValues:
    """Return the axes that move the TCP somewhere, its orientation as close as possible.

    The orientation is projected first and the position kept (documented,
    docs/reference/softmotion.md 3.1).

    Raises:
        Refused: Out of reach.
    """
    rotation = flange_rotation(kinematics, tcp, tool)
    return _axes_for(kinematics, tcp, tool, rotation, configuration, near=near)


def _axes_for(
    kinematics: KinematicsModel,
    tcp: Frame,
    tool: Frame,
    rotation: Matrix,
    configuration: Configuration,
    *,
    near: AxisValues,
) -> AxisValues:
    flange = Frame(subtract(tcp.shift_mm, turned(rotation, tool.shift_mm)), rotation)
    return kinematics.axes_for(flange, configuration, near)


def plan_line(
    kinematics: KinematicsModel, start: AxisValues, target: Frame, tool: Frame
) -> LinePath:
    """Plan a straight movement of the TCP that keeps the configuration.

    Raises:
        Refused: The target is out of reach.
    """
    configuration = kinematics.configuration(start)
    end = axes_for_tcp(kinematics, target, tool, configuration, near=start)
    return LinePath(
        kinematics=kinematics,
        tool=tool,
        configuration=configuration,
        start=start,
        end=end,
        start_tcp=kinematics.flange(start) @ tool,
        end_tcp=kinematics.flange(end) @ tool,
    )


def line_pace(path: LinePath, dynamics: Dynamics, axes: Sequence[Axis]) -> Pace | None:
    """Check every stretch of a line and return how fast it may be covered.

    The whole line is checked before anything moves (assumed: a real group may notice a line
    that leaves the workspace only on the way). Near a singularity the TCP slows down so that
    no axis exceeds its limits; a line that only turns is as fast as the axes.

    Raises:
        Refused: The line leaves the workspace or an axis its limits.
    """
    stretches = path.length_mm / _CHECK_EVERY_MM + path.turn_deg / _CHECK_EVERY_DEG
    steps = max(1, math.ceil(min(stretches, _MOST_CHECKS)))
    places = [path.axes_at(step / steps) for step in range(steps + 1)]
    for place in places[1:]:
        require_inside(place, axes)
    slopes = [max(abs(b[n] - a[n]) for a, b in pairwise(places)) * steps for n in range(len(axes))]
    limit = _axis_pace(slopes, axes)
    if limit is None or path.length_mm < _STILL:
        return limit
    return Pace(
        min(dynamics.velocity / path.length_mm, limit.rate_per_s),
        min(dynamics.acceleration / path.length_mm, limit.rise_per_s2),
        min(dynamics.deceleration / path.length_mm, limit.fall_per_s2),
    )


def direct_pace(path: JointPath, factors: Dynamics, axes: Sequence[Axis]) -> Pace | None:
    """Return how fast a direct movement may be.

    Raises:
        Refused: Its end lies outside the limits of an axis.
    """
    require_inside(path.end, axes)
    slopes = [abs(b - a) for a, b in zip(path.start, path.end, strict=True)]
    limit = _axis_pace(slopes, axes)
    if limit is None:
        return None
    return Pace(
        limit.rate_per_s * factors.velocity,
        limit.rise_per_s2 * factors.acceleration,
        limit.fall_per_s2 * factors.deceleration,
    )


def require_inside(values: AxisValues, axes: Sequence[Axis]) -> None:
    """Refuse axis values outside the software limits.

    Raises:
        Refused: Names the axis, the value and the limits.
    """
    for axis, value in zip(axes, values, strict=True):
        axis.require_inside(value)


def _axis_pace(slopes: Sequence[float], axes: Sequence[Axis]) -> Pace | None:
    moving = [(slope, axis.limits) for slope, axis in zip(slopes, axes, strict=True)]
    moving = [(slope, limits) for slope, limits in moving if slope > _STILL]
    if not moving:
        return None
    ramp = min(limits.acceleration_per_s2 / slope for slope, limits in moving)
    return Pace(min(limits.velocity_per_s / slope for slope, limits in moving), ramp, ramp)


Position = tuple[float, ...]
"""``SMC_POS_REF``: six numbers, axis values in ACS, otherwise X, Y, Z, A, B, C."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where a movement leads.

    Attributes:
        position: Axis values, or a pose of the TCP.
        system: What the position counts in. TCS stands at the TCP where the movement starts.
        configuration: Which way of reaching it; a missing member keeps the present one.
    """

    position: Position
    system: CoordSystem = CoordSystem.MCS
    configuration: Configuration = ANY_CONFIGURATION


class Planner:
    """Resolves targets for one kinematics.

    Args:
        kinematics: Of the group.
        axes: Its drives.
        transforms: Where the coordinate systems stand.
    """

    def __init__(
        self, kinematics: KinematicsModel, axes: Sequence[Axis], transforms: CoordinateTransforms
    ) -> None:
        self._kinematics = kinematics
        self._axes = axes
        self._transforms = transforms

    def line(
        self, start: AxisValues, target: Target, tool: Frame, dynamics: Dynamics
    ) -> tuple[LinePath, Pace | None]:
        """Plan a straight movement of the TCP.

        Raises:
            Refused: A value is not usable, or the line cannot be covered.
        """
        dynamics.require_usable()
        tcp = self.tcp(start, target, tool)
        self._require_same_configuration(start, target)
        path = plan_line(self._kinematics, start, tcp, tool)
        return path, line_pace(path, dynamics, self._axes)

    def direct(
        self, start: AxisValues, target: Target, tool: Frame, factors: Dynamics
    ) -> tuple[JointPath, Pace | None]:
        """Plan a movement straight in axis space.

        Raises:
            Refused: A value is not usable, or the target cannot be reached.
        """
        factors.require_usable(most=1.0)
        if target.system is CoordSystem.ACS:
            end = self._axis_target(target)
        else:
            tcp = self.tcp(start, target, tool)
            end = axes_for_tcp(self._kinematics, tcp, tool, target.configuration, near=start)
            end = tuple(_inside(value, axis) for value, axis in zip(end, self._axes, strict=True))
        path = JointPath(start, end)
        return path, direct_pace(path, factors, self._axes)

    def base(self, start: AxisValues, system: CoordSystem, tool: Frame) -> Frame:
        """Return where a coordinate system stands in MCS when a movement starts; ACS as MCS."""
        if system is CoordSystem.ACS:
            return ORIGIN
        return self._transforms.in_mcs(system, self._kinematics.flange(start) @ tool)

    def tcp(self, start: AxisValues, target: Target, tool: Frame) -> Frame:
        """Return where a target moves the TCP, in MCS.

        Args:
            start: Axes where the movement starts: TCS stands there.
            target: The target.
            tool: Flange to TCP.

        Raises:
            Refused: The position is no position of its coordinate system.
        """
        if target.system is CoordSystem.ACS:
            return self._kinematics.flange(self._axis_target(target)) @ tool
        _require_finite(target.position, 6)
        return self.base(start, target.system, tool) @ CoordRef(*target.position).frame()

    def _axis_target(self, target: Target) -> AxisValues:
        values = target.position[: len(self._axes)]
        _require_finite(values, len(self._axes))
        return values

    def _require_same_configuration(self, start: AxisValues, target: Target) -> None:
        present = self._kinematics.configuration(start)
        wanted = target.configuration
        if target.system is CoordSystem.ACS:
            wanted = self._kinematics.configuration(self._axis_target(target))
        if wanted.contradicts(present):
            raise BlockRefused(
                ErrorKind.CONFIGURATION, "A straight movement keeps arm, elbow and hand"
            )


def _inside(value: float, axis: Axis) -> float:
    """Return a rotary value a whole turn away when only that lies inside the limits."""
    if axis.kind is AxisKind.ROTARY and not axis.limits.holds(value):
        for turn in (-360.0, 360.0):
            if axis.limits.holds(value + turn):
                return value + turn
    return value


def _require_finite(values: Sequence[float], count: int) -> None:
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise BlockRefused(ErrorKind.PARAMETER, f"Not {count} finite numbers: {tuple(values)}")
