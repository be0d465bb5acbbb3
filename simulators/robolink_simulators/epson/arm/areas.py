"""Boxes and planes about a robot: those that are watched, and the one that limits it.

Boxes and planes whose approach a controller checks (docs/reference/spel.md 5.5).

The box that XYLim holds a robot in (docs/reference/spel.md 7.2).
"""

from collections.abc import Mapping, Sequence
from typing import Final, Generic, NamedTuple, TypeVar

from robolink_simulators.cell.frames import Frame, zyx
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

HIGHEST_AREA: Final = 15
_OFF: Final = (0.0, 0.0)

Coordinates = tuple[float, float, float, float, float, float]
"""X, Y, Z in mm and U, V, W in degrees."""

Span = tuple[float, float]
"""Lowest and highest value in mm; two zeros switch the check off (documented)."""


class CheckBox(NamedTuple):
    """Lowest and highest X, Y and Z, as a local sees them.

    Attributes:
        spans: Of X, Y and Z.
        local: In which local.
        shows_on: Whether a remote output that stands for it is on inside, or off; no output is
            assigned to one here.
    """

    spans: tuple[Span, Span, Span]
    local: int = 0
    shows_on: bool = True

    def holds(self, place: Coordinates) -> bool:
        """Return whether a place, seen from its local, lies inside; its faces count (assumed)."""
        checked = [(s, at) for s, at in zip(self.spans, place, strict=False) if s != _OFF]
        return bool(checked) and all(low <= at <= high for (low, high), at in checked)


class CheckPlane(NamedTuple):
    """The XY plane of a coordinate system; what lies on its +Z side is inside (documented)."""

    coordinates: Coordinates

    def holds(self, place: Coordinates) -> bool:
        """Return whether a place of the base is on the +Z side or on the plane itself (assumed)."""
        x, y, z, u, v, w = self.coordinates
        back = Frame((x, y, z), zyx(u, v, w)).inverse()
        return back.point((place[0], place[1], place[2]))[2] >= 0


_Area = TypeVar("_Area", CheckBox, CheckPlane)


class AreaTable(Generic[_Area]):
    """Boxes or planes 1 to 15 of one robot.

    Args:
        word: What they are called.
        no_number: The refusal of another number.
        undefined: The refusal of one that is not defined.
    """

    def __init__(self, word: str, no_number: RefusalKind, undefined: RefusalKind) -> None:
        self._word = word
        self._no_number = no_number
        self._undefined = undefined
        self._areas: dict[int, _Area] = {}

    def find(self, number: int) -> _Area | None:
        """Return an area, ``None`` where none is defined.

        Raises:
            Refusal: There is no such number.
        """
        if not 1 <= number <= HIGHEST_AREA:
            raise SpelRefusal(self._no_number, f"There is no {self._word} {number}")
        return self._areas.get(number)

    def get(self, number: int) -> _Area:
        """Return an area.

        Raises:
            Refusal: It is not defined, or there is no such number.
        """
        area = self.find(number)
        if area is None:
            raise SpelRefusal(self._undefined, f"{self._word} {number} is not defined")
        return area

    def set(self, number: int, area: _Area) -> None:
        """Define an area.

        Raises:
            Refusal: There is no such number.
        """
        self.find(number)
        self._areas[number] = area

    def clear(self, number: int) -> None:
        """Remove an area; removing an undefined one is allowed.

        Raises:
            Refusal: There is no such number.
        """
        self.find(number)
        self._areas.pop(number, None)

    def all(self) -> dict[int, _Area]:
        """Return the areas by their numbers."""
        return dict(sorted(self._areas.items()))

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {str(number): list(area) for number, area in self._areas.items()}


class CheckedAreas:
    """Where one robot's tip is watched.

    Attributes:
        boxes: Box 1 to 15.
        planes: Plane 1 to 15.
    """

    def __init__(self) -> None:
        self.boxes = AreaTable[CheckBox]("Box", RefusalKind.BOX_NUMBER, RefusalKind.BOX_UNDEFINED)
        self.planes = AreaTable[CheckPlane](
            "Plane", RefusalKind.PLANE_NUMBER, RefusalKind.PLANE_UNDEFINED
        )

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {"boxes": self.boxes.to_state(), "planes": self.planes.to_state()}

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            KeyError, TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError("not the areas of a robot")
        for number, (spans, local, shows_on) in state["boxes"].items():
            x, y, z = ((float(low), float(high)) for low, high in spans)
            self.boxes.set(int(number), CheckBox((x, y, z), int(local), bool(shows_on)))
        for number, (coordinates,) in state["planes"].items():
            px, py, pz, u, v, w = map(float, coordinates)
            self.planes.set(int(number), CheckPlane((px, py, pz, u, v, w)))


_PAIRS: Final = (2, 3)
_SAME_MM: Final = 1e-6

Corner = tuple[float, float, float]


class XYLimits:
    """Lowest and highest X, Y and Z of one robot, in the robot's coordinates.

    Two zeros limit nothing: documented where all are 0, assumed for one of the pairs.

    Attributes:
        strict: XYLimMode 1: the way counts too, not the target alone.
    """

    def __init__(self) -> None:
        self.strict = False
        self._pairs: tuple[tuple[float, float], ...] = (_OFF, _OFF)

    @property
    def defined(self) -> bool:
        """Whether anything is limited."""
        return any(pair != _OFF for pair in self._pairs)

    @property
    def values(self) -> tuple[float, ...]:
        """The limits as they were given: X, Y, and Z if it was."""
        return tuple(end for pair in self._pairs for end in pair)

    @property
    def corners(self) -> tuple[Corner, Corner]:
        """The lowest and the highest X, Y, Z, 0 where nothing is limited."""
        (x0, x1), (y0, y1), (z0, z1) = (*self._pairs, _OFF)[:3]
        return (x0, y0, z0), (x1, y1, z1)

    def set(self, values: Sequence[float]) -> None:
        """Limit X, Y and, with six values, Z.

        Raises:
            Refusal: Neither four nor six values, or a lowest above its highest.
        """
        pairs = tuple(zip(map(float, values[::2]), map(float, values[1::2]), strict=False))
        if len(values) % 2 or len(pairs) not in _PAIRS:
            raise SpelRefusal(RefusalKind.SYNTAX, f"XYLim does not take {len(values)} values")
        if any(low > high for low, high in pairs):
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "A lower limit lies above its upper")
        self._pairs = pairs

    def clear(self) -> None:
        """Limit nothing."""
        self.set((*_OFF, *_OFF))

    def outside_mm(self, place: Sequence[float]) -> float:
        """Return how far a place (X, Y, Z in mm) lies outside, 0 where it does not."""
        limited = zip(self._pairs, place, strict=False)
        beyond = [max(low - at, at - high) for (low, high), at in limited if (low, high) != _OFF]
        return max([0.0, *(by for by in beyond if by > _SAME_MM)])

    def to_state(self) -> list[float]:
        """Return what survives power-off, ready for JSON."""
        return list(self.values)

    def restore(self, state: object) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) not in (4, 6):
            raise ValueError("not the limits of a robot")
        pairs = [
            (float(low), float(high)) for low, high in zip(state[::2], state[1::2], strict=True)
        ]
        if any(low > high for low, high in pairs):
            raise ValueError("not the limits of a robot")
        self._pairs = tuple(pairs)
