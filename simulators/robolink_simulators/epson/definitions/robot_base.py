"""Where the base of one robot stands: Base (docs/reference/spel.md 5.4).

Points, locals, areas and what is printed count from the base; joints, XYLim and LimZ from the
robot.
"""

from robolink_simulators.epson.definitions.local_frames import Coordinates, Local
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

_LEVEL_DEG = 1e-6


class RobotBase:
    """The base of one robot, seen from the robot itself.

    Args:
        tilting: Whether the robot tilts its tool, so that its base may lean. Of a SCARA V and W are
            0, as those of its locals are (assumed).

    Attributes:
        changes: How often it was moved.
    """

    def __init__(self, *, tilting: bool) -> None:
        self.changes = 0
        self._tilting = tilting
        self._place = Local()

    @property
    def coordinates(self) -> Coordinates:
        """Where it stands: X, Y, Z in mm and U, V, W in degrees."""
        at = self._place
        return (at.x_mm, at.y_mm, at.z_mm, at.u_deg, at.v_deg, at.w_deg)

    @property
    def moved(self) -> bool:
        """Whether it is another than the robot's own."""
        return any(self.coordinates)

    @property
    def leans(self) -> bool:
        """Whether its XY plane is not that of the robot."""
        return max(abs(self._place.v_deg), abs(self._place.w_deg)) > _LEVEL_DEG

    def move(self, coordinates: Coordinates) -> bool:
        """Put it elsewhere; tell whether that is another place.

        Raises:
            Refusal: It would lean, and the robot does not tilt its tool.
        """
        x, y, z, u, v, w = coordinates
        place = Local(x, y, z, u, v, w)
        if max(abs(v), abs(w)) > _LEVEL_DEG and not self._tilting:
            raise SpelRefusal(
                RefusalKind.VALUE_OUT_OF_RANGE, "V and W of the base are 0 on a SCARA"
            )
        if place == self._place:
            return False
        self._place = place
        self.changes += 1
        return True

    def seen(self, in_robot: Coordinates) -> Coordinates:
        """Return coordinates of the robot as the base sees them."""
        return self._place.seen(in_robot, tilting=self._tilting) if self.moved else in_robot

    def in_robot(self, seen: Coordinates) -> Coordinates:
        """Return coordinates of the base as the robot sees them."""
        return self._place.carried(seen, tilting=self._tilting) if self.moved else seen

    def to_state(self) -> list[float]:
        """Return what survives power-off, ready for JSON."""
        return list(self.coordinates)

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list):
            raise ValueError(state)
        x, y, z, u, v, w = map(float, state)
        self._place = Local(x, y, z, u, v, w)
        self.changes += 1
