"""What goes wrong with pictures, as parameters of the simulated world, and what refuses it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

_FLECK: Final = {"picture_fleck": "tip", "picture_fleck_radius_px": 25.0}
_DISC: Final = {"picture_fleck": "disc", "picture_fleck_radius_px": 25.0}
_LAMPS: Final = {"picture_fleck": "lamps", "picture_fleck_radius_px": 25.0}
_AWAY: Final = {"camera_moved_mm": 60.0}

FAULTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "fleck": _FLECK,
    "fleck in place of the tip": {**_FLECK, "picture_tip_hidden": True},
    "lamp ring": {**_LAMPS, "picture_tip_hidden": True},
    "stuck picture": {"picture_stuck": "same"},
    "stuck picture, new noise": {"picture_stuck": "noisy", "picture_faults_from": 3},
    "late by three pictures": {"picture_late": 3},
    "late stream": {"picture_late_s": 1.5},
    "second nozzle": {"second_tip_beside_mm": 2.5},
    "1 mm out of focus": {"picture_defocus_mm": 1.0},
    "cut": {"camera_moved_mm": 5.1, "camera_moved_toward_deg": 93.0},
}
"""Faults by their names."""

_CUT_MM: Final = {"runout-table": 4.4, "camera-affine": 2.2}
"""How far the camera has to be moved for that: each method begins at another place."""

BOARD_FAULTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "fleck": _DISC,
    "fleck in place of the tip": {**_DISC, **_AWAY},
    "lamp ring": {**_LAMPS, **_AWAY},
    "second nozzle": {**_DISC, "picture_fleck_beside_px": 130.0},
}
"""The same for fiducials, which look otherwise; a camera that looks away hides a board."""


@dataclass(frozen=True)
class Codes:
    """By what a fault is refused.

    Attributes:
        tip: Where a tip is looked for.
        board: Where fiducials are.
    """

    tip: tuple[str, ...]
    board: tuple[str, ...]

    def of(self, method: str) -> tuple[str, ...]:
        """Return the codes of a method."""
        return self.board if method == "board" else self.tip


_STALE: Final = Codes(("stale_picture",), ("stale_picture",))
_STILL: Final = Codes(("tip_did_not_move",), ("tip_did_not_move",))
_SEVERAL: Final = Codes(("several_tips_seen",), ("several_fiducials_seen",))

CODES: Final[Mapping[str, Codes]] = {
    "fleck": _SEVERAL,
    "fleck in place of the tip": _STILL,
    "lamp ring": Codes(("tip_not_seen",), ("fiducial_not_seen", "tip_did_not_move")),
    "stuck picture": _STALE,
    "stuck picture, new noise": Codes(
        ("tip_did_not_move", "tip_not_seen"), ("tip_did_not_move", "fiducial_not_seen")
    ),
    "late by three pictures": _STALE,
    "late stream": _STALE,
    "second nozzle": _SEVERAL,
    "1 mm out of focus": Codes(("out_of_focus",), ("out_of_focus",)),
    "cut": Codes(("tip_cut",), ("tip_cut",)),
}
"""The refusals of a measurement."""


def fault_of(name: str, method: str) -> Mapping[str, Any]:
    """Return the parameters of a fault."""
    if name == "cut":
        return {**FAULTS[name], "camera_moved_mm": _CUT_MM.get(method, 5.1)}
    return BOARD_FAULTS.get(name, FAULTS[name]) if method == "board" else FAULTS[name]
