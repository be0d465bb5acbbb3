"""The arm asked beforehand about the movements of a plan."""

from dataclasses import dataclass
from itertools import starmap

from robolink.calibration import tip_pose
from robolink.model import Controller, MotionGroup, Pose, ToolOffset
from robolink.runner._foreseeing import considered, nothing_in_the_way
from robolink.runner._steps import Consider, Move


@dataclass(frozen=True, slots=True)
class ArmAhead:
    """What an arm says about movements of its flange that nobody has made yet.

    Attributes:
        group: The arm.
        tool: The tool in force now, for which its controller answers.
        selected: Its offset.
    """

    group: MotionGroup
    tool: int
    selected: ToolOffset | None

    @classmethod
    def of(cls, controller: Controller) -> "ArmAhead":
        """Return the arm of a controller, with the tool that is in force."""
        group = controller.groups[0]
        tool = group.pose().tool or 0
        return cls(group, tool, controller.tools.read(tool) if tool else None)

    def considered(self, step: Consider, *, known: bool) -> tuple[str, ...]:
        """Answer what a procedure wants to know; nothing where its places are not known."""
        # Where a person will have brought the tip is not known, so neither what is in the way.
        if not known:
            return nothing_in_the_way(step, known=known)
        return tuple(starmap(self.obstacle, considered(step)))

    def obstacle(self, move: Move, start: Pose | None) -> str:
        """Return why the arm cannot make a movement of the flange, empty where it can."""
        begin = None if start is None else self._tip(start)
        return self.group.obstacle(self._tip(move.target), move.path, start=begin)

    def _tip(self, flange: Pose) -> Pose:
        if self.selected is None:
            return flange
        return tip_pose(flange, self.selected, tool=self.tool)
