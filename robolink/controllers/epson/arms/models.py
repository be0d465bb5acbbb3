"""What the maker's files say of the arms of EPSON robots: lengths and highest joint speeds.

Source: docs/reference/epson-robots.md, "Joint speeds". Derived from epson-robot-ros2 at 7ead19a,
Copyright 2025 Seiko Epson Corporation, Apache-2.0.
"""

import re
from dataclasses import dataclass
from typing import Final

from robolink.controllers.movement_time import JointRates


@dataclass(frozen=True, slots=True)
class ArmModel:
    """One arm.

    Attributes:
        lengths_mm: Both arms of a SCARA; of six axes the six lengths of ArmSet.
        rates: Its joints at Speed 100 and Accel 100, unloaded.
        hangs: Whether it is a six-axis robot under a ceiling.
    """

    lengths_mm: tuple[float, ...]
    rates: JointRates
    hangs: bool = False


_C12: Final = (472.0, 100.0, 650.0, 30.0, 650.0, 80.0)
_C8_ACCELERATIONS: Final = (629.1, 596.05, 1583.1, 2838.13, 3862.38, 18745.42)
_GX4: Final = (450.0, 720.0, 1152.0, 3157.895)
_GX8: Final = (576.0, 672.0, 2387.201, 2828.572)
_RS6: Final = (413.106, 720.0, 1440.0, 3582.09)

_MODELS: Final = {
    "GX4-C25": ((120.0, 130.0), _GX4, (5922.32, 16685.49, 29003.91, 31983.95)),
    "GX4-C30": ((170.0, 130.0), _GX4, (4518.99, 12792.21, 29003.91, 31983.95)),
    "GX4-C35": ((220.0, 130.0), _GX4, (3862.38, 12359.62, 21972.66, 31983.95)),
    "GX8-C45": ((200.0, 250.0), _GX8, (3570.56, 5493.16, 30212.4, 38844.53)),
    "GX8-C55": ((300.0, 250.0), _GX8, (3089.9, 5493.16, 30212.4, 38844.53)),
    "GX8-C65": ((400.0, 250.0), _GX8, (2087.4, 5493.16, 30212.4, 38844.53)),
    "RS4-C35": (
        (175.0, 175.0),
        (668.16, 705.882, 1119.936, 3000.0),
        (6301.76, 9155.27, 48889.16, 47607.42),
    ),
    "RS6-C552S": ((275.0, 275.0), _RS6, (2750.98, 3982.54, 29525.76, 23448.43)),
    "RS6-C552C": ((275.0, 275.0), _RS6, (2653.99, 3841.78, 29525.76, 23448.43)),
    "C8-C90": (
        (472.0, 100.0, 400.0, 30.0, 400.0, 80.0),
        (294.118, 300.0, 360.0, 480.0, 450.0, 720.0),
        (2145.77, 1922.61, 3948.21, 5264.28, 9698.87, 18745.42),
    ),
    "C8-C140": (_C12, (199.897, 166.667, 200.0, 480.0, 450.0, 720.0), _C8_ACCELERATIONS),
    "C12-C140": (_C12, (199.897, 166.667, 200.0, 300.0, 360.0, 720.0), _C8_ACCELERATIONS),
    "CX4-A60": (
        (320.0, 60.0, 260.0, 30.0, 280.0, 72.5),
        (449.979, 449.931, 514.782, 558.824, 570.0, 851.541),
        (2818.64, 3951.39, 5698.5, 4871.03, 5930.61, 10987.61),
    ),
    "CX7-A70": (
        (320.0, 60.0, 310.0, 30.0, 330.0, 81.5),
        (414.786, 389.889, 486.988, 558.824, 547.485, 851.541),
        (1008.78, 1340.33, 2072.18, 2435.52, 2968.03, 18751.21),
    ),
    "CX7-A90": (
        (320.0, 60.0, 410.0, 30.0, 430.0, 81.5),
        (332.65, 312.683, 390.554, 558.824, 547.485, 851.541),
        (770.49, 560.87, 1246.39, 2435.52, 2968.03, 18751.21),
    ),
}
"""By the beginning of a model's name: lengths, speeds in degrees/s and mm/s, accelerations in
degrees/s2 and mm/s2."""

_SIX_LENGTHS_MM: Final = {
    "C4-A60": (320.0, 100.0, 250.0, 0.0, 250.0, 65.0),
    "C4-A90": (320.0, 100.0, 400.0, 0.0, 400.0, 65.0),
    "VT6L": (412.0, 100.0, 420.0, 0.0, 400.0, 80.0),
}
_LENGTHS_MM: Final = {
    "T3-40": (225.0, 175.0),
    "T6-60": (325.0, 275.0),
    "LS3-40": (225.0, 175.0),
    "LS6-50": (275.0, 225.0),
    "LS6-60": (325.0, 275.0),
    "LS20-B80": (350.0, 450.0),
    "G6-65": (400.0, 250.0),
    "G1-17": (75.0, 100.0),
    **_SIX_LENGTHS_MM,
}
"""Lengths of those whose joint speeds no readable document has; a cell file may state them."""

_SIX_AXES: Final = 6


def arm_of(model: str, stated: JointRates | None = None) -> ArmModel | None:
    """Return the arm of a model.

    Args:
        model: Its name, as the controller tells it.
        stated: How fast its joints are, by the cell file; this goes before the table.

    Returns:
        ``None`` where its lengths or its joint speeds are not known.

    Example:
        >>> from robolink.controllers.epson.arms.models import arm_of
        >>> arm_of("GX8-C652S").rates.speeds[0], arm_of("T6-602S")
        (576.0, None)
    """
    name = model.strip().upper()
    for start, (lengths_mm, speeds, accelerations) in _MODELS.items():
        if name.startswith(start):
            rates = stated or JointRates(speeds, accelerations)
            return ArmModel(lengths_mm, rates, _hangs(name, lengths_mm))
    for start, known_mm in _LENGTHS_MM.items():
        if stated is not None and name.startswith(start):
            return ArmModel(known_mm, stated, _hangs(name, known_mm))
    return None


def _hangs(name: str, lengths_mm: tuple[float, ...]) -> bool:
    """Return whether a name is that of a six-axis robot for a ceiling: a digit, S or C, and R."""
    return len(lengths_mm) == _SIX_AXES and re.search(r"\d[SC]R$", name) is not None
