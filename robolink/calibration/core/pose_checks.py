"""What makes poses and other numbers unfit, by name (docs/reference/calibration.md 3)."""

import math
from collections.abc import Sequence
from dataclasses import replace

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset

MAX_OFFSET_MM = 1000.0
"""A tool longer than this is taken for a mistake (docs/reference/calibration.md 3)."""

_METRES_BELOW = 2.0


def check_poses(poses: Sequence[Pose], *, allow_mixed_hand: bool) -> tuple[str, ...]:
    """Refuse poses that cannot belong together; return the names of lesser doubts.

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``mixed_local``, ``mixed_tool``
            or ``mixed_hand``.
    """
    _check_finite(poses)
    _check_units(poses)
    if len({pose.local for pose in poses}) > 1:
        raise CalibrationError(
            "mixed_local",
            tr("The poses are given in different local coordinate systems."),
            remedy=tr("Give all of them in local 0, the base."),
        )
    if len({pose.tool for pose in poses if pose.tool is not None}) > 1:
        raise CalibrationError(
            "mixed_tool",
            tr("The poses were taken with different tools selected."),
            remedy=tr("Take all of them in Tool 0."),
        )
    if len({pose.hand for pose in poses if pose.hand is not None}) > 1:
        if not allow_mixed_hand:
            raise CalibrationError(
                "mixed_hand",
                tr("The poses were taken with different arm configurations."),
                remedy=tr(
                    "Take all of them with the same hand, so that errors of the arm lengths cancel."
                ),
            )
        return ("mixed_hand",)
    return ()


def keep_unmeasured(stored: ToolOffset | None, **measured: float) -> ToolOffset:
    """Return ``stored`` with the measured components replaced.

    Raises:
        CalibrationError: ``implausible_offset`` when a length is beyond any tool.
    """
    offset = replace(stored or ToolOffset(), **measured)
    longest = max(abs(offset.x_mm), abs(offset.y_mm), abs(offset.z_mm))
    if longest > MAX_OFFSET_MM:
        raise CalibrationError(
            "implausible_offset",
            tr(
                "The offset would be {longest:.1f} mm long; no tool is longer than {limit:.0f} mm.",
                longest=longest,
                limit=MAX_OFFSET_MM,
            ),
            remedy=tr("Check that both poses touch the same point and are flange poses."),
        )
    return offset


def _check_finite(poses: Sequence[Pose]) -> None:
    names = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
    for number, pose in enumerate(poses, start=1):
        if all(type(value) is float and math.isfinite(value) for value in pose.coordinates()):
            continue  # nearly always; what is no float may be one all the same
        for name, value in zip(names, pose.coordinates(), strict=True):
            if not isinstance(value, (int, float)) or not math.isfinite(value):
                raise CalibrationError(
                    "non_finite",
                    tr(
                        "Pose {number} has {name} = {value!r}.",
                        number=number,
                        name=name,
                        value=value,
                    ),
                    remedy=tr("Give finite numbers in mm and degrees."),
                )


def _check_units(poses: Sequence[Pose]) -> None:
    # A flange of a robot that reaches over 100 mm never stays within 2 mm of its own base
    # axis; the size of the offset says nothing (docs/reference/calibration.md 3).
    if all(abs(p.x_mm) < _METRES_BELOW and abs(p.y_mm) < _METRES_BELOW for p in poses):
        raise CalibrationError(
            "suspect_units",
            tr("All positions lie within 2 mm of the base axis: these look like metres."),
            remedy=tr("Give lengths in mm and angles in degrees."),
        )


def require_finite(**values: float) -> None:
    """Refuse what is not a finite number, by its name.

    Raises:
        CalibrationError: ``non_finite``.
    """
    for name, value in values.items():
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            raise CalibrationError(
                "non_finite",
                tr("{name} is {value!r}.", name=name, value=value),
                remedy=tr("Give finite numbers in mm and degrees."),
            )
