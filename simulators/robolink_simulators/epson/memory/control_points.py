"""External control points: places of the base that a held workpiece is moved about.

Source: docs/reference/spel.md 6.2.
"""

from typing import Final

from robolink_simulators.epson.definitions.local_frames import Coordinates
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

HIGHEST_CONTROL_POINT: Final = 15


class ControlPoints:
    """Control points 1 to 15 of one robot, and the one in force; a power cycle selects none.

    Attributes:
        selected: Number of the one in force, 0 for none.
    """

    def __init__(self) -> None:
        self.selected = 0
        self._places: dict[int, Coordinates] = {}

    def defined(self, number: int) -> bool:
        """Tell whether one is defined.

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
        """Put one in force, 0 for none.

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
