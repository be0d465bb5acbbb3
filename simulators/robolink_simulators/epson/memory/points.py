"""Points, external control points and pallets that a controller remembers.

SPEL+ point values, locals and the point memory P0 to P999 (docs/reference/spel.md 5).

External control points: places of the base that a held workpiece is moved about.

Source: docs/reference/spel.md 6.2.

Pallets: points in rows and columns between corners (docs/reference/spel.md 5.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.model import Hand, Pose, Posture
from robolink_simulators.epson.arm.coordinate_systems import Coordinates, Local
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

AXES: Final = "XYZUVW"
"""The order of a point's coordinates."""

HIGHEST_POINT: Final = 999
HIGHEST_LOCAL: Final = 15


@dataclass(slots=True)  # not frozen: each look at the arm makes one, in a third of the time
class Point:
    """A SPEL+ point value.

    Attributes:
        coordinates: X, Y, Z in mm, U, V, W in degrees, as seen from ``local``.
        hand: Right unless stated (seen in transcripts: ``/R``).
        posture: Elbow, wrist and joint flags, ``None`` where none was named.
        local: The local coordinate system of the coordinates, 0 for the base.
        given: How many coordinates the statement that made it named.
    """

    coordinates: Coordinates
    hand: Hand = Hand.RIGHT
    local: int = 0
    given: int = 6
    posture: Posture | None = None

    @classmethod
    def at(cls, pose: Pose) -> "Point":
        """Return the point of a pose, in the frame that the pose is in."""
        return cls(pose.coordinates(), hand=pose.hand or Hand.RIGHT, posture=pose.posture)

    def with_axis(self, axis: str, value: float) -> "Point":
        """Return the point with one coordinate (a letter of :data:`AXES`) replaced."""
        index = AXES.index(axis)
        x, y, z, u, v, w = (value if i == index else old for i, old in enumerate(self.coordinates))
        return replace(self, coordinates=(x, y, z, u, v, w), given=max(self.given, index + 1))

    def assigned(self, what: str, value: float) -> "Point":
        """Return the point with a coordinate replaced, or for ``LOCAL`` its local.

        Raises:
            Refusal: There is no such local, or no such coordinate.
        """
        if what == "LOCAL":
            if not 0 <= value <= HIGHEST_LOCAL:
                raise SpelRefusal(RefusalKind.LOCAL_NUMBER, f"There is no local {value:g}")
            return replace(self, local=int(value))
        if what not in AXES:
            raise SpelRefusal(RefusalKind.OTHER_ROBOT, f"This robot has no axis {what}")
        return self.with_axis(what, value)

    def shifted(self, axis: str, by: float) -> "Point":
        """Return the point with ``by`` added to one coordinate."""
        return self.with_axis(axis, self.coordinates[AXES.index(axis)] + by)

    def plus(self, other: "Point", sign: int = 1) -> "Point":
        """Add coordinate by coordinate; flags and local stay this point's (inferred)."""
        x, y, z, u, v, w = (
            a + sign * b for a, b in zip(self.coordinates, other.coordinates, strict=True)
        )
        return replace(self, coordinates=(x, y, z, u, v, w))


class LocalTable:
    """Locals 1 to 15; local 0 is the base and always there.

    Args:
        tilting: Whether the robot tilts its tool, so that locals may lean.
    """

    def __init__(self, *, tilting: bool = False) -> None:
        self.tilting = tilting
        self._locals: dict[int, Local] = {0: Local()}

    def defined(self, number: int) -> bool:
        """Return whether a local is defined (LocalDef)."""
        return number in self._locals

    def get(self, number: int) -> Local:
        """Return a local.

        Raises:
            Refusal: It is not defined.
        """
        if number not in self._locals:
            raise SpelRefusal(RefusalKind.LOCAL_UNDEFINED, f"Local {number} is not defined")
        return self._locals[number]

    def define(self, number: int, local: Local) -> None:
        """Define local 1 to 15.

        Raises:
            Refusal: There is no such local to define.
        """
        if not 1 <= number <= HIGHEST_LOCAL:
            raise SpelRefusal(RefusalKind.LOCAL_NUMBER, f"There is no local {number} to define")
        self._locals[number] = local

    def clear(self, number: int) -> None:
        """Remove local 1 to 15; removing an undefined one is allowed.

        Raises:
            Refusal: There is no such local to forget.
        """
        if number == 0:
            raise SpelRefusal(RefusalKind.LOCAL_ZERO, "Local 0 is the base")
        if not 1 <= number <= HIGHEST_LOCAL:
            raise SpelRefusal(RefusalKind.LOCAL_NUMBER, f"There is no local {number} to clear")
        self._locals.pop(number, None)

    def clear_all(self) -> None:
        """Forget locals 1 to 15."""
        self._locals = {0: Local()}

    def to_base(self, point: Point) -> Point:
        """Return a point in the base frame."""
        local = self.get(point.local)
        if point.local == 0:
            return point
        coordinates = local.to_base(point.coordinates, tilting=self.tilting)
        return replace(point, coordinates=coordinates, local=0)

    def convert(self, point: Point, number: int) -> Point:
        """Return a point in another local (the modifier ``@n``, docs/reference/spel.md 5.2)."""
        if number == point.local:
            return point
        base, local = self.to_base(point), self.get(number)
        if number == 0:
            return base
        coordinates = local.from_base(base.coordinates, tilting=self.tilting)
        return replace(base, coordinates=coordinates, local=number)


class PointTable:
    """The point memory of one robot."""

    def __init__(self) -> None:
        self._points: dict[int, Point] = {}
        self._labels: dict[str, int] = {}
        self._descriptions: dict[int, str] = {}

    def describe(self, number: int, text: str) -> None:
        """Keep a description of a stored point (PDescription).

        Raises:
            Refusal: The point is not defined.
        """
        self.get(number)
        self._descriptions[number] = text

    def description(self, number: int) -> str:
        """Return the description of a point, empty without one."""
        return self._descriptions.get(number, "")

    def label(self, number: int, name: str) -> None:
        """Give a point a name; another point loses that name."""
        self.defined(number)
        self._labels[name.lower()] = number

    def labelled(self, name: str) -> int | None:
        """Return the number of the point with a name."""
        return self._labels.get(name.lower())

    def labels(self) -> dict[str, int]:
        """Return the number of each label, in lower case."""
        return dict(self._labels)

    def clear(self) -> None:
        """Forget every point and label."""
        self._points.clear()
        self._labels.clear()
        self._descriptions.clear()

    def get(self, number: int) -> Point:
        """Return a stored point.

        Raises:
            Refusal: The number does not exist (0 to 999) or nothing is stored.
        """
        if not self.defined(number):
            raise SpelRefusal(RefusalKind.POINT_UNDEFINED, f"Point P{number} is not defined")
        return self._points[number]

    def defined(self, number: int) -> bool:
        """Return whether a point is stored.

        Raises:
            Refusal: The number does not exist.
        """
        if not 0 <= number <= HIGHEST_POINT:
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"There is no point P{number}")
        return number in self._points

    def store(self, number: int, point: Point) -> None:
        """Store a point.

        Raises:
            Refusal: The number does not exist.
        """
        self.defined(number)
        self._points[number] = point

    def delete(self, first: int, last: int) -> None:
        """Forget a range of points; undefined ones are fine (docs/reference/spel.md 5.1)."""
        for number in self.numbers(first, last):
            del self._points[number]
            self._descriptions.pop(number, None)

    def numbers(self, first: int = 0, last: int = HIGHEST_POINT) -> list[int]:
        """Return the numbers of the stored points in a range.

        Raises:
            Refusal: The range runs backwards.
        """
        if first > last:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Point range {first}, {last}")
        return sorted(number for number in self._points if first <= number <= last)


HIGHEST_CONTROL_POINT: Final = 15


class ControlPoints:
    """Control points 1 to 15 of one robot, and the selected one; a power cycle selects none.

    Attributes:
        selected: Number of the one in force, 0 for none.
    """

    def __init__(self) -> None:
        self.selected = 0
        self._places: dict[int, Coordinates] = {}

    def defined(self, number: int) -> bool:
        """Return whether one is defined.

        Raises:
            Refusal: There is no such number.
        """
        if not 0 <= number <= HIGHEST_CONTROL_POINT:
            raise SpelRefusal(RefusalKind.ECP_NUMBER, f"There is no control point {number}")
        return number in self._places

    def numbers(self) -> list[int]:
        """Return the numbers of those that are defined."""
        return sorted(self._places)

    def get(self, number: int) -> Coordinates:
        """Return where one is, X Y Z in mm and U V W in degrees.

        Raises:
            Refusal: It is not defined.
        """
        if not self.defined(number):
            raise SpelRefusal(RefusalKind.ECP_UNDEFINED, f"ECP {number} is not defined")
        return self._places[number]

    def set(self, number: int, place: Coordinates) -> None:
        """Define one.

        Raises:
            Refusal: Number 0, or no such number.
        """
        self._require_own(number)
        self._places[number] = place

    def clear(self, number: int) -> None:
        """Forget one.

        Raises:
            Refusal: Number 0, no such number, or the one in force (documented).
        """
        self._require_own(number)
        if self.selected == number:
            raise SpelRefusal(RefusalKind.ECP_IN_FORCE, f"ECP {number} is in force")
        self._places.pop(number, None)

    def select(self, number: int) -> None:
        """Select one, 0 for none.

        Raises:
            Refusal: It is not defined.
        """
        if number:
            self.get(number)
        self.selected = number

    def _require_own(self, number: int) -> None:
        self.defined(number)
        if number == 0:
            raise SpelRefusal(RefusalKind.ECP_ZERO, "ECP 0 stands for none")


HIGHEST_PALLET: Final = 15
_MOST_PLACES: Final = 32766


@dataclass(frozen=True, slots=True)
class Pallet:
    """Columns run from corner 1 to 2, rows from corner 1 to 3.

    Attributes:
        corners: Corners 1, 2 and 3, and the one opposite to 1 if it was given.
        columns: How many.
        rows: How many.
        outside: Whether places beyond its edges may be named by column and row.
    """

    corners: tuple[Point, ...]
    columns: int
    rows: int
    outside: bool = False

    def place(self, *position: int) -> Point:
        """Return a place by its number, counted along the columns from 1, or by column and row.

        Hand, local, U, V and W are corner 1's (documented). Four corners are interpolated
        bilinearly (inferred; the rule is not given).

        Raises:
            Refusal: There is no such place.
        """
        if len(position) == 1:
            row, column = divmod(position[0] - 1, self.columns)
        else:
            column, row = (number - 1 for number in position)
        named = len(position) > 1 and self.outside
        if not named and not (0 <= column < self.columns and 0 <= row < self.rows):
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"No place {position} on the pallet")
        along, across = _share(column, self.columns), _share(row, self.rows)
        x, y, z = (self._coordinate(axis, along, across) for axis in range(3))
        first = self.corners[0]
        return replace(first, coordinates=(x, y, z, *first.coordinates[3:]))

    def _coordinate(self, axis: int, along: float, across: float) -> float:
        first, second, third = (corner.coordinates[axis] for corner in self.corners[:3])
        flat = first + (second - first) * along + (third - first) * across
        if len(self.corners) == 3:
            return flat
        return flat + (self.corners[3].coordinates[axis] - second - third + first) * along * across


def _share(index: int, count: int) -> float:
    return index / (count - 1) if count > 1 else 0.0


class PalletTable:
    """Pallets 0 to 15."""

    def __init__(self) -> None:
        self._pallets: dict[int, Pallet] = {}

    def get(self, number: int) -> Pallet:
        """Return a pallet.

        Raises:
            Refusal: It is not defined.
        """
        if number not in self._pallets:
            raise SpelRefusal(RefusalKind.PALLET_UNDEFINED, f"Pallet {number} is not defined")
        return self._pallets[number]

    def all(self) -> dict[int, Pallet]:
        """Return the pallets by their numbers."""
        return dict(sorted(self._pallets.items()))

    def define(
        self,
        number: int,
        corners: Sequence[Point],
        columns: int,
        rows: int,
        *,
        outside: bool = False,
    ) -> None:
        """Define a pallet.

        Raises:
            Refusal: There is no such number, or no such size.
        """
        if not 0 <= number <= HIGHEST_PALLET:
            raise SpelRefusal(RefusalKind.PALLET_NUMBER, f"There is no pallet {number}")
        if columns < 1 or rows < 1:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Pallet {number}, {columns}, {rows}")
        if columns * rows > _MOST_PLACES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"{columns * rows} places")
        self._pallets[number] = Pallet(tuple(corners), columns, rows, outside)

    def clear(self, number: int) -> None:
        """Remove a pallet; removing an undefined one is allowed."""
        self._pallets.pop(number, None)
