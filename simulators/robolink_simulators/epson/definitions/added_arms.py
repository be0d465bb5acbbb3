"""Added arms: other lengths and offsets that a robot is told of (docs/reference/spel.md 6.2)."""

from collections.abc import Mapping, Sequence
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

HIGHEST_ARM: Final = 15
_SELECTED: Final = "in_force"


class AddedArms:
    """Arm 0, which is the robot's own, and added arms 1 to 15 of one robot.

    Args:
        own: The values of arm 0, as ArmSet lists them.

    Attributes:
        selected: Which is in force.
        changes: How often one was set, cleared or put in force.
    """

    def __init__(self, own: Sequence[float]) -> None:
        self._own = tuple(own)
        self._added: dict[int, tuple[float, ...]] = {}
        self.selected = 0
        self.changes = 0

    def is_defined(self, number: int) -> bool:
        """Tell whether an arm is defined; arm 0 is.

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
        self.changes += 1

    def clear(self, number: int) -> None:
        """Forget an added arm; one that is not defined is none after it, too.

        Raises:
            Refusal: Arm 0, the arm in force, or no such number.
        """
        self._require_added(number)
        if number == self.selected:
            raise SpelRefusal(RefusalKind.ARM_IN_FORCE, f"Arm {number} is in force")
        self._added.pop(number, None)
        self.changes += 1

    def select(self, number: int) -> None:
        """Put an arm in force.

        Raises:
            Refusal: It is not defined, or there is no such number.
        """
        self.values(number)
        self.selected = number
        self.changes += 1

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        added = {str(number): list(values) for number, values in self._added.items()}
        return {**added, _SELECTED: self.selected}

    def restore(self, state: object) -> None:
        """Take over what :meth:`to_state` returned.

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
