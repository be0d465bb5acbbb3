"""The origins of coordinates: locals, the base, and added arms.

Coordinates of SPEL+ and systems that they count from (docs/reference/spel.md 5.4).

Where the base of one robot stands: Base (docs/reference/spel.md 5.4).

Points, locals, areas and what is printed count from the base; joints, XYLim and LimZ from the
robot.

Added arms: other lengths and offsets that a robot is told of (docs/reference/spel.md 6.2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.model import rotate_xy
from robolink_simulators.cell.frames import Frame, printed_angles, zyx
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

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

    def to_base(self, coordinates: Coordinates, *, tilting: bool) -> Coordinates:
        """Return coordinates of this local in the base, for a robot that tilts its tool or not.

        A local of two pairs is turned about Z alone: with BaseU its U is simply not added.
        """
        if tilting and not self.base_u:
            return coordinates_of_frame(self.frame @ frame_at(coordinates))
        x, y, z, u, v, w = coordinates
        dx_mm, dy_mm = rotate_xy(x, y, self.u_deg)
        turned_deg = u if self.base_u else u + self.u_deg
        return (self.x_mm + dx_mm, self.y_mm + dy_mm, self.z_mm + z, turned_deg, v, w)

    def from_base(self, coordinates: Coordinates, *, tilting: bool) -> Coordinates:
        """Return base coordinates in this local; undoes :meth:`to_base`."""
        if tilting and not self.base_u:
            return coordinates_of_frame(self.frame.inverse() @ frame_at(coordinates))
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


_LEVEL_DEG = 1e-6


class RobotBase:
    """The base of one robot, seen from the robot itself.

    Args:
        tilting: Whether the robot tilts its tool, so that its base may lean. Of a SCARA V and W are
            0, as those of its locals are (assumed).
    """

    def __init__(self, *, tilting: bool) -> None:
        self._tilting = tilting
        self._place = Local()

    @property
    def coordinates(self) -> Coordinates:
        """Where it stands: X, Y, Z in mm and U, V, W in degrees."""
        at = self._place
        return (at.x_mm, at.y_mm, at.z_mm, at.u_deg, at.v_deg, at.w_deg)

    @property
    def moved(self) -> bool:
        """Whether it differs from the robot's own."""
        return any(self.coordinates)

    @property
    def tilted(self) -> bool:
        """Whether its XY plane is not that of the robot."""
        return max(abs(self._place.v_deg), abs(self._place.w_deg)) > _LEVEL_DEG

    def move(self, coordinates: Coordinates) -> bool:
        """Move it elsewhere; return whether that is another place.

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
        return True

    def to_base(self, coordinates: Coordinates) -> Coordinates:
        """Return coordinates of the robot as the base sees them."""
        if not self.moved:
            return coordinates
        return self._place.from_base(coordinates, tilting=self._tilting)

    def to_robot(self, coordinates: Coordinates) -> Coordinates:
        """Return coordinates of the base as the robot sees them."""
        if not self.moved:
            return coordinates
        return self._place.to_base(coordinates, tilting=self._tilting)

    def to_state(self) -> list[float]:
        """Return what survives power-off, ready for JSON."""
        return list(self.coordinates)

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list):
            raise ValueError(state)
        x, y, z, u, v, w = map(float, state)
        self._place = Local(x, y, z, u, v, w)


HIGHEST_ARM: Final = 15
_SELECTED: Final = "in_force"


class AddedArms:
    """Arm 0, which is the robot's own, and added arms 1 to 15 of one robot.

    Args:
        own: The values of arm 0, as ArmSet lists them.

    Attributes:
        selected: Which is in force.
    """

    def __init__(self, own: Sequence[float]) -> None:
        self._own = tuple(own)
        self._added: dict[int, tuple[float, ...]] = {}
        self.selected = 0

    def is_defined(self, number: int) -> bool:
        """Return whether an arm is defined; arm 0 is.

        Raises:
            Refusal: There is no such number.
        """
        if not 0 <= number <= HIGHEST_ARM:
            raise SpelRefusal(RefusalKind.ARM_NUMBER, f"There is no arm {number}")
        return number == 0 or number in self._added

    def values(self, number: int) -> tuple[float, ...]:
        """Return the values of an arm, mm and degrees.

        Raises:
            Refusal: It is not defined, or there is no such number.
        """
        if not self.is_defined(number):
            raise SpelRefusal(RefusalKind.ARM_UNDEFINED, f"Arm {number} is not defined")
        return self._added.get(number, self._own)

    def all(self) -> dict[int, tuple[float, ...]]:
        """Return the values of every arm that is defined, by number."""
        return {0: self._own, **dict(sorted(self._added.items()))}

    def set(self, number: int, values: Sequence[float]) -> None:
        """Define an added arm; what is left out at the end is as of the own arm (assumed).

        Raises:
            Refusal: Arm 0, or no such number.
        """
        self._require_added(number)
        self._added[number] = (*map(float, values), *self._own[len(values) :])

    def clear(self, number: int) -> None:
        """Remove an added arm; removing an undefined one is allowed.

        Raises:
            Refusal: Arm 0, the selected arm, or no such number.
        """
        self._require_added(number)
        if number == self.selected:
            raise SpelRefusal(RefusalKind.ARM_IN_FORCE, f"Arm {number} is in force")
        self._added.pop(number, None)

    def select(self, number: int) -> None:
        """Select an arm.

        Raises:
            Refusal: It is not defined, or there is no such number.
        """
        self.values(number)
        self.selected = number

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        added = {str(number): list(values) for number, values in self._added.items()}
        return {**added, _SELECTED: self.selected}

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError("not the arms of a robot")
        selected = state.get(_SELECTED, 0)
        arms = {number: values for number, values in state.items() if number != _SELECTED}
        added = {int(number): tuple(map(float, values)) for number, values in arms.items()}
        if any(len(values) != len(self._own) for values in added.values()):
            raise ValueError("not the arms of this robot")
        if not set(added) <= set(range(1, HIGHEST_ARM + 1)):
            raise ValueError("no such arms")
        if selected not in {0, *added}:
            raise ValueError("no such arm in force")
        self._added, self.selected = added, selected

    def _require_added(self, number: int) -> None:
        self.is_defined(number)
        if number == 0:
            raise SpelRefusal(RefusalKind.ARM_ZERO, "Arm 0 is fixed")
