"""The names of calibration methods in entries that robolink 0.1 wrote.

An entry is never changed, since its hash would be another. Whoever shows or compares one asks here.
"""

from collections.abc import Mapping
from typing import Any, Final

_FORMER: Final = {
    "two_pose": "two-pose",
    "n_angle": "n-angle",
    "one_touch": "one-touch",
    "z_touch": "z-touch",
    "six_point": "six-point",
    "crossed_beams": "beams",
    "up_camera": "camera",
    "camera_affine": "camera-affine",
    "board_fit": "board",
}
"""What was written, and the name of the method now."""


def method_name_now(written: str) -> str:
    """Return a method's name of now; one that never changed comes back as it is."""
    return _FORMER.get(written, written)


def with_method_name_now(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return the details of an entry, with the method called what it is called now."""
    written = details.get("method")
    now = {"method": method_name_now(written)} if isinstance(written, str) else {}
    return {**details, **now}


def finding_named_now(how: str) -> str:
    """Return how a station was found, "METHOD with tool N", with the method's name of now."""
    method, blank, rest = how.partition(" ")
    return f"{method_name_now(method)}{blank}{rest}"
