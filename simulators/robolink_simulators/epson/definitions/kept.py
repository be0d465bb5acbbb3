"""What one robot keeps over a power cycle besides its tools."""

from collections.abc import Mapping, Sequence

from robolink_simulators.epson.definitions.added_arms import AddedArms
from robolink_simulators.epson.definitions.arches import ArchTable
from robolink_simulators.epson.definitions.areas import CheckedAreas
from robolink_simulators.epson.definitions.curves import CurveFiles
from robolink_simulators.epson.definitions.joint_origins import JointOrigins
from robolink_simulators.epson.definitions.joint_ranges import JointRanges
from robolink_simulators.epson.definitions.robot_base import RobotBase
from robolink_simulators.epson.definitions.xy_limits import XYLimits


class KeptDefinitions:
    """What one robot is told once and keeps over a power cycle, but for its tools.

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

    @property
    def changes(self) -> int:
        """How often something of it was changed."""
        parts = (self.arches, self.arms, self.areas, self.curves, self.limits)
        return sum(part.changes for part in (*parts, self.ranges, self.base, self.origins))

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {
            "arches": self.arches.to_state(),
            "arms": self.arms.to_state(),
            "areas": self.areas.to_state(),
            "curves": self.curves.to_state(),
            "limits": self.limits.to_state(),
            "ranges": self.ranges.to_state(),
            "base": self.base.to_state(),
            "origins": self.origins.to_state(),
        }

    def restore(self, state: Mapping[str, object]) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        self.arches.restore(state["arches"])
        self.arms.restore(state["arms"])
        if "areas" in state:  # a file of before there were any
            self.areas.restore(state["areas"])
        self.curves.restore(state["curves"])
        self.limits.restore(state["limits"])
        if "ranges" in state:
            self.ranges.restore(state["ranges"])
        if "base" in state:
            self.base.restore(state["base"])
        if "origins" in state:
            self.origins.restore(state["origins"])
