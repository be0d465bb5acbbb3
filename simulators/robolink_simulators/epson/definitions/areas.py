"""Boxes and planes whose approach a controller checks (docs/reference/spel.md 5.5)."""

from collections.abc import Mapping
from typing import Final, Generic, NamedTuple, TypeVar

from robolink_simulators.cell.frames import Frame, zyx
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

HIGHEST_AREA: Final = 15
_OFF: Final = (0.0, 0.0)

Coordinates = tuple[float, float, float, float, float, float]
"""X, Y, Z in mm and U, V, W in degrees."""

Span = tuple[float, float]
"""Lowest and highest, in mm; two zeros check nothing (documented)."""


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
        """Tell whether a place, seen from its local, lies inside; its faces count (assumed)."""
        checked = [(s, at) for s, at in zip(self.spans, place, strict=False) if s != _OFF]
        return bool(checked) and all(low <= at <= high for (low, high), at in checked)


class CheckPlane(NamedTuple):
    """The XY plane of a coordinate system; what lies on its +Z side is inside (documented)."""

    coordinates: Coordinates

    def holds(self, place: Coordinates) -> bool:
        """Tell whether a place of the base lies on the +Z side, the plane itself too (assumed)."""
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

    Attributes:
        changes: How often one was defined or cleared.
    """

    def __init__(self, word: str, no_number: RefusalKind, undefined: RefusalKind) -> None:
        self._word = word
        self._no_number = no_number
        self._undefined = undefined
        self._areas: dict[int, _Area] = {}
        self.changes = 0

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
        self.changes += 1

    def clear(self, number: int) -> None:
        """Forget an area; one that is not defined is none after it, too.

        Raises:
            Refusal: There is no such number.
        """
        self.find(number)
        self._areas.pop(number, None)
        self.changes += 1

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

    @property
    def changes(self) -> int:
        """How often one was defined or cleared."""
        return self.boxes.changes + self.planes.changes

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {"boxes": self.boxes.to_state(), "planes": self.planes.to_state()}

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

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
