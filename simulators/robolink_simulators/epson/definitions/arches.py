"""The seven arches of Jump (docs/reference/spel.md 7.1)."""

from typing import Final, NamedTuple

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

GATE: Final = 7
"""C7, the default: straight up, across, straight down (documented)."""


class Arch(NamedTuple):
    """How far a Jump rises before it begins to travel, and falls after it has travelled, in mm."""

    depart_mm: float
    approach_mm: float


AT_DELIVERY: Final = tuple(Arch(10.0 * n, 10.0 * n) for n in range(3, 10))
"""30, 40 ... 90 mm on both sides (docs/reference/spel.md 6.3)."""


class ArchTable:
    """Arches 0 to 6 of one robot; nothing puts them back (documented).

    Attributes:
        changes: How often one was changed.
    """

    def __init__(self) -> None:
        self.changes = 0
        self._arches = list(AT_DELIVERY)

    def get(self, number: int) -> Arch | None:
        """Return an arch, ``None`` for C7, the gate.

        Raises:
            Refusal: There is no such number.
        """
        if number == GATE:
            return None
        self._require(number)
        return self._arches[number]

    def set(self, number: int, arch: Arch) -> None:
        """Change an arch; that neither distance is below 0 is assumed.

        Raises:
            Refusal: No such number, or such a distance.
        """
        self._require(number)
        if min(arch) < 0:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "An arch is not below 0 mm")
        self._arches[number] = arch
        self.changes += 1

    def all(self) -> tuple[Arch, ...]:
        """Return arches 0 to 6."""
        return tuple(self._arches)

    def to_state(self) -> list[list[float]]:
        """Return what survives power-off, ready for JSON."""
        return [list(arch) for arch in self._arches]

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        if not isinstance(state, list) or len(state) != len(AT_DELIVERY):
            raise ValueError("not the arches of a robot")
        self._arches = [Arch(float(depart), float(approach)) for depart, approach in state]

    def _require(self, number: int) -> None:
        if not 0 <= number < GATE:
            raise SpelRefusal(RefusalKind.ARCH_NUMBER, f"There is no arch {number}")
