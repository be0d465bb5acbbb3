"""SPEL+ point values, locals and the point memory P0 to P999 (docs/reference/spel.md 5)."""

from dataclasses import dataclass, replace
from typing import Final

from robolink.model import Hand, Pose, Posture
from robolink_simulators.epson.definitions.local_frames import Coordinates, Local
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

AXES: Final = "XYZUVW"
"""The order of a point's coordinates."""

HIGHEST_POINT: Final = 999
HIGHEST_LOCAL: Final = 15


@dataclass(frozen=True, slots=True)
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
        """Tell whether a local is defined (LocalDef)."""
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
        """Forget local 1 to 15; one that is not defined may be forgotten.

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
        """Express a point in the base frame."""
        local = self.get(point.local)
        if point.local == 0:
            return point
        coordinates = local.carried(point.coordinates, tilting=self.tilting)
        return replace(point, coordinates=coordinates, local=0)

    def convert(self, point: Point, number: int) -> Point:
        """Express a point in another local (the modifier ``@n``, docs/reference/spel.md 5.2)."""
        if number == point.local:
            return point
        base, local = self.to_base(point), self.get(number)
        if number == 0:
            return base
        seen = local.seen(base.coordinates, tilting=self.tilting)
        return replace(base, coordinates=seen, local=number)


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
        """Return the description of a point, nothing where it has none."""
        return self._descriptions.get(number, "")

    def label(self, number: int, name: str) -> None:
        """Give a point a name; where it was the name of another point, it is moved."""
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
        """Tell whether a point is stored.

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
