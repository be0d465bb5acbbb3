"""From a commanded position to a path."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from robolink.model import AxisKind
from robolink_simulators.cell.frames import ORIGIN, Frame
from robolink_simulators.softmotion.kinematics.coordinates import (
    CoordinateTransforms,
    CoordRef,
    CoordSystem,
)
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    KinematicsModel,
)
from robolink_simulators.softmotion.motion.axes import Axis
from robolink_simulators.softmotion.motion.paths import (
    Dynamics,
    JointPath,
    LinePath,
    axes_for_tcp,
    direct_pace,
    line_pace,
    plan_line,
)
from robolink_simulators.softmotion.motion.profile import Pace
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

Position = tuple[float, ...]
"""``SMC_POS_REF``: six numbers, axis values in ACS, else X, Y, Z, A, B, C."""


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
        """Return where a target brings the TCP, in MCS.

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
