"""How many axes a robot has, by its model name."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

_FAMILIES: Final[Mapping[str, int]] = MappingProxyType(
    {"GX": 4, "RS": 4, "T": 4, "LS": 4, "G": 4, "C": 6, "CX": 6, "VT": 6}
)
"""Number of axes by the letters before the first digit of an EPSON model
(docs/reference/epson-robots.md)."""

_KINEMATICS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "Kin_Scara2_Z": 3,
        "Kin_Scara3_Z": 4,
        "Kin_Polar_Z": 3,
        "Kin_Gantry3": 3,
        "Kin_HGantry3": 3,
        "Kin_Pos_RRR": 3,
        "Kin_5Axes": 5,
        "Kin_ArticulatedRobot_6DOF": 6,
        "Kin_4AxisPalletizer": 4,
    }
)
"""Number of axes of kinematics that need no orientation kinematics (docs/reference/softmotion.md
3.3)."""


def axes_of_model(kind: str, model: str | None) -> int | None:
    """Return how many axes a robot of a model has.

    Args:
        kind: The first word of its controller's URL.
        model: The model as the controller says it, ``None`` where nobody wrote it down.

    Returns:
        ``None`` where only a connected controller tells it.

    Example:
        >>> from robolink.controllers import axes_of_model
        >>> axes_of_model("epson", "T6-602S"), axes_of_model("epson", "C8-C901S")
        (4, 6)
        >>> axes_of_model("softmotion", "Kin_Gantry3+Kin_CAxis") is None
        True
    """
    if model is None:
        return None
    if kind == "softmotion":
        return _KINEMATICS.get(model)
    family = re.match(r"([A-Z]+)\d", model) if kind == "epson" else None
    return None if family is None else _FAMILIES.get(family[1])
