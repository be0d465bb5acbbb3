"""Between the user units of a mailbox and the millimetres of the simulated group."""

import struct
from collections.abc import Callable, Sequence

from robolink.model import AxisKind
from robolink.protocols.mailbox import Four, Six
from robolink_simulators.softmotion.kinematics.coordinates import CoordRef
from robolink_simulators.softmotion.motion.paths import Dynamics

_UM_PER_MM = 1000.0


class UserUnits:
    """Scales lengths; angles are degrees on both sides.

    Args:
        unit_um: Micrometres per user unit.

    Attributes:
        unit_um: The same, as a REAL holds it.
    """

    def __init__(self, unit_um: float) -> None:
        (self.unit_um,) = struct.unpack("<f", struct.pack("<f", unit_um))
        self._mm = self.unit_um / _UM_PER_MM

    def tool(self, frame: Six) -> CoordRef:
        """Return a tool offset in mm."""
        x, y, z, a, b, c = frame
        return CoordRef(x * self._mm, y * self._mm, z * self._mm, a, b, c)

    def pose(self, frame: Six) -> Six:
        """Return a pose in mm."""
        return self.tool(frame).components()

    def given(self, frame: CoordRef) -> Six:
        """Return a tool offset or pose in user units.

        There is no minus zero in it: a program that takes numbers apart has none.
        """
        x, y, z, a, b, c = (value + 0.0 for value in frame.components())
        return (x / self._mm, y / self._mm, z / self._mm, a, b, c)

    def axes(self, values: Six, kinds: Sequence[AxisKind]) -> Six:
        """Return axis values in mm and degrees."""
        return _six(values, kinds, lambda value: value * self._mm)

    def given_axes(self, values: Sequence[float], kinds: Sequence[AxisKind]) -> Six:
        """Return axis values in user units and degrees; axes that are not there are 0."""
        return _six([value + 0.0 for value in values], kinds, lambda value: value / self._mm)

    def dynamics(self, numbers: Four, *, factors: bool = False) -> Dynamics:
        """Return velocity and the rest in mm, or unchanged when they are factors."""
        if factors:
            return Dynamics(*numbers)
        return Dynamics(*(number * self._mm for number in numbers))


def _six(
    values: Sequence[float], kinds: Sequence[AxisKind], scale: Callable[[float], float]
) -> Six:
    scaled = [
        scale(value) if kind is AxisKind.LINEAR else value
        for value, kind in zip(values, kinds, strict=False)
    ]
    a0, a1, a2, a3, a4, a5 = (*scaled, *(0.0,) * (6 - len(scaled)))
    return (a0, a1, a2, a3, a4, a5)
