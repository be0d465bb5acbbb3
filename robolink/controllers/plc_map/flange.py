"""Where the flange is, from a PLC that tells it; a person moves."""

from typing import Final, NoReturn

from robolink.controllers.motion_group import MotionGroupCore
from robolink.controllers.plc_map.link import MappedPlc
from robolink.controllers.plc_map.values import OffsetValues
from robolink.errors import RejectedError
from robolink.messages import tr
from robolink.model import Pose
from robolink.register_maps import span_of
from robolink.ways import Way, way

_FAR_MM: Final = 100_000.0
_FAR_DEG: Final = 36_000.0
"""No head stands farther away or is turned more often."""


class FlangeReader(MotionGroupCore):
    """The axis group of a PLC with a map: it may tell where it is, and is never moved."""

    def __init__(self, plc: MappedPlc) -> None:
        super().__init__(plc)
        self._plc = plc
        self._registers = plc.registers
        self._flange = plc.register_map.flange
        self._name = plc.register_map.name
        self._values = OffsetValues(plc.register_map, plc.identity)

    @property
    def name(self) -> str:
        """What the map calls the machine."""
        return self._name

    def pose(self) -> Pose:
        """Read where the flange is now.

        Raises:
            RejectedError: The map has no ``[flange]``.
        """
        if not self._flange:
            raise RejectedError(
                tr("This PLC does not report where the flange is."),
                remedy=tr(
                    "Read the poses at the HMI and give them with {poses}; or add [flange] to the "
                    "map, if the PLC has registers for it.",
                    poses=way(Way.GIVEN_POSES),
                ),
                controller=self._registers.identity,
            )
        span = span_of(self._flange)
        table = self._flange["x"].table
        words = dict(zip(span, self._registers.read_twice(table, span), strict=True))
        pose = self._values.numbers(self._flange, words, largest_mm=_FAR_MM, largest_deg=_FAR_DEG)
        return Pose(*pose, tool=0)

    def move_to(self, *_asked: object, **_how: object) -> NoReturn:
        """Refuse, and so does all that would move or stop the machine.

        Raises:
            RejectedError: Always.
        """
        raise self._plc.no_motion()

    def require_able(self, purpose: str) -> NoReturn:
        """Refuse, as :meth:`move_to` does."""
        self.move_to(purpose)

    move_until_input = requests_until = requests_for = obstacle = terms = stop = move_to
    deceleration_mm_s2 = run_up_mm = edge_step_mm = move_to
