"""Free curves that Curve stores and CVMove travels (docs/reference/spel.md 7.1)."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

Place = tuple[float, ...]
"""X, Y, Z in mm, U in degrees, on six axes V and W too, in the robot's coordinates."""

AXES_OF_CURVES: Final = (2, 3, 4)
"""How many of X, Y, Z, U a curve of four axes rules; the others stay (assumed)."""

SIX_AXES: Final = 6
"""How many a curve of a robot of six axes rules."""

TANGENTIAL: Final = 2
"""The mode of a curve that turns U with its direction in the plane (documented)."""


class CurveSwitch(NamedTuple):
    """A bit that switches as the tip passes a point; ``word`` is On, Off, MemOn or MemOff."""

    point: int
    word: str
    number: int


class FreeCurve(NamedTuple):
    """What one Curve stored; ``places`` of a closed one end where they begin.

    ``tangential``: U follows the direction of the way instead of the points. ``control_point``: the
    number of the external control point that the workpiece is led past, 0 for none.
    """

    axes: int
    places: tuple[Place, ...]
    switches: tuple[CurveSwitch, ...] = ()
    tangential: bool = False
    control_point: int = 0


class CurveFiles:
    """The curve files of one robot, by name in any case.

    Attributes:
        changes: How often one was stored.
    """

    def __init__(self) -> None:
        self.changes = 0
        self._files: dict[str, FreeCurve] = {}

    def store(self, name: str, curve: FreeCurve) -> None:
        """Store a curve; one of the same name is replaced."""
        self._files[name.lower()] = curve
        self.changes += 1

    def get(self, name: str) -> FreeCurve:
        """Return a curve.

        Raises:
            Refusal: There is no such file.
        """
        curve = self._files.get(name.lower())
        if curve is None:
            raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no curve {name}")
        return curve

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return dict(self._files)

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, Mapping):
            raise TypeError("not the curves of a robot")
        self._files = {str(name): _restored(*parts) for name, parts in state.items()}


def _restored(
    axes: int,
    places: list[list[float]],
    switches: list[list[object]],
    tangential: object = False,  # a file of before there were any has none
    control_point: int = 0,
) -> FreeCurve:
    read = tuple(tuple(map(float, place)) for place in places)
    if len({len(place) for place in read} - {4, 6}) or len({len(place) for place in read}) > 1:
        raise ValueError("places of a curve have four numbers, or six")
    bits = tuple(CurveSwitch(int(str(at)), str(word), int(str(n))) for at, word, n in switches)
    number = int(control_point)
    return FreeCurve(int(axes), read, bits, tangential=bool(tangential), control_point=number)
