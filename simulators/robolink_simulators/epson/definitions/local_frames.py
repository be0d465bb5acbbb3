"""Coordinates of SPEL+ and systems that they count from (docs/reference/spel.md 5.4)."""

from dataclasses import dataclass

from robolink.model import rotate_xy
from robolink_simulators.cell.frames import Frame, printed_angles, zyx

Coordinates = tuple[float, float, float, float, float, float]
"""X, Y, Z in mm and U, V, W in degrees."""


@dataclass(frozen=True, slots=True)
class Local:
    """A local coordinate system, seen from the base (V and W are 0 on a SCARA).

    Attributes:
        base_u: Whether U of its points is that of the base (BaseU).
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0
    u_deg: float = 0.0
    v_deg: float = 0.0
    w_deg: float = 0.0
    base_u: bool = False

    @property
    def frame(self) -> Frame:
        """Where it stands in the base."""
        return frame_at((self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg))

    def carried(self, coordinates: Coordinates, *, tilting: bool) -> Coordinates:
        """Express coordinates of this local in the base, of a robot that tilts its tool or not.

        A local of two pairs is turned about Z alone: with BaseU its U is simply not added.
        """
        if tilting and not self.base_u:
            return coordinates_of_frame(self.frame @ frame_at(coordinates))
        return self.to_base(coordinates)

    def seen(self, coordinates: Coordinates, *, tilting: bool) -> Coordinates:
        """Express base coordinates in this local; undoes :meth:`carried`."""
        if tilting and not self.base_u:
            return coordinates_of_frame(self.frame.inverse() @ frame_at(coordinates))
        return self.from_base(coordinates)

    def to_base(self, coordinates: Coordinates) -> Coordinates:
        """Express coordinates of this planar local in the base frame, U taken literally."""
        x, y, z, u, v, w = coordinates
        dx_mm, dy_mm = rotate_xy(x, y, self.u_deg)
        turned_deg = u if self.base_u else u + self.u_deg
        return (self.x_mm + dx_mm, self.y_mm + dy_mm, self.z_mm + z, turned_deg, v, w)

    def from_base(self, coordinates: Coordinates) -> Coordinates:
        """Express base coordinates in this planar local."""
        x, y, z, u, v, w = coordinates
        in_x, in_y = rotate_xy(x - self.x_mm, y - self.y_mm, -self.u_deg)
        return (in_x, in_y, z - self.z_mm, u if self.base_u else u - self.u_deg, v, w)


def frame_at(coordinates: Coordinates) -> Frame:
    """Return the frame of X, Y, Z in mm and U, V, W in degrees."""
    x, y, z, u, v, w = coordinates
    return Frame((x, y, z), zyx(u, v, w))


def coordinates_of_frame(frame: Frame) -> Coordinates:
    """Return X, Y, Z in mm and U, V, W in degrees of a frame, as they are printed."""
    return (*frame.shift_mm, *printed_angles(frame.rotation))
