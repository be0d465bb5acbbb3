"""How touches of a tilted tool are named, for a person."""

from robolink.messages import tr
from robolink.model import Pose


class TiltedNames:
    """What is the same for all samplers whose tool is tilted and turned."""

    __slots__ = ()

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X, Y and Z")

    def counted(self, count: int) -> str:
        """Return how many were taken."""
        return tr("{count} touches", count=count)

    def named(self, pose: Pose) -> str:
        """Return where one was taken."""
        return tr("U {u:.1f} V {v:.1f} W {w:.1f}", u=pose.u_deg, v=pose.v_deg, w=pose.w_deg)

    def which(self, number: int, pose: Pose) -> str:
        """Return which one it is."""
        return tr("Touch {number} at {where}", number=number, where=self.named(pose))
