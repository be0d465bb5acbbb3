"""A machine of one's own: two SCARA arms that hold one flange, and a lift."""

from math import acos, atan2, cos, degrees, dist, hypot, radians, sin, sqrt

from robolink import model

Z = (0.0, 0.0, 1.0)


class DoubleScara:
    """a0 and a1 turn the inner arms, whose ends the outer arms join at the flange; a2 lifts it.

    The flange is fixed to the outer arm of a1, so it turns as that arm does, and how is not known
    before the place is: only its Z is. That is what the orientation image says.
    """

    kinds = (model.AxisKind.ROTARY, model.AxisKind.ROTARY, model.AxisKind.LINEAR)
    axis_settings = ((100.0, 160.0), (20.0, 80.0), (-150.0, 50.0))

    def __init__(self, base: float = 200.0, inner: float = 200.0, outer: float = 320.0) -> None:
        self.motors = ((-base / 2, 0.0), (base / 2, 0.0))
        self.inner, self.outer = inner, outer

    def axes_to_cartesian(self, axes: model.AxisPositions) -> model.FlangeFrame:
        """Return where the flange is, and how it is turned."""
        (ax, ay), (bx, by) = self._elbows(axes)
        apart = dist((ax, ay), (bx, by))
        if not 0 < apart <= 2 * self.outer:
            raise model.NotReachable("The outer arms do not meet")
        rise = sqrt(self.outer**2 - apart**2 / 4) / apart
        x, y = (ax + bx) / 2 - rise * (by - ay), (ay + by) / 2 + rise * (bx - ax)
        c, s = (x - bx) / self.outer, (y - by) / self.outer
        return (x, y, axes[2]), ((c, -s, 0.0), (s, c, 0.0), Z)

    def cartesian_to_axes(
        self, flange: model.FlangeFrame, near: model.AxisPositions
    ) -> model.AxisPositions:
        """Return the axes with both elbows outwards."""
        (x, y, z), _ = flange
        angles = []
        for (at, _), side in zip(self.motors, (1, -1), strict=True):
            far = hypot(x - at, y)
            cosine = (self.inner**2 + far**2 - self.outer**2) / (2 * self.inner * far)
            if abs(cosine) > 1:
                raise model.NotReachable("Out of an arm's reach")
            angles.append(degrees(atan2(y, x - at) + side * acos(cosine)))
        return (*angles, z)

    def get_orientation_image(self) -> model.OrientationSpace:
        """Return that Z of the flange is Z of the machine, and no more (ISMPositionKinematics2)."""
        return model.OrientationSpace.directed(v_u=Z, v_rot=Z)

    def _elbows(self, axes: model.AxisPositions) -> list[tuple[float, float]]:
        return [
            (at + self.inner * cos(radians(angle)), self.inner * sin(radians(angle)))
            for (at, _), angle in zip(self.motors, axes, strict=False)
        ]
