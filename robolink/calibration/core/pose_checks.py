"""What makes poses and other numbers unfit, by name (docs/reference/calibration.md 3)."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Hand, Pose, ToolOffset

MAX_OFFSET_MM = 1000.0
"""A tool longer than this is taken for a mistake (docs/reference/calibration.md 3)."""

METRES_BELOW = 2.0
"""No flange stays so near to its own base axis, in mm; in metres most do."""


def check_poses(
    poses: Sequence[Pose], *, allow_mixed_hand: bool, of_one_tip: bool = False
) -> tuple[str, ...]:
    """Refuse poses that cannot belong together; return the names of lesser doubts.

    Args:
        poses: Flange poses.
        allow_mixed_hand: Warn instead of refusing when the arm was configured differently.
        of_one_tip: They may be poses of one tool's tip instead.

    Raises:
        CalibrationError: ``non_finite``, ``suspect_units``, ``mixed_local``, ``mixed_tool``,
            ``tool_pose`` or ``mixed_hand``.
    """
    require_finite_poses(poses)
    refuse_metres(all(abs(p.x_mm) < METRES_BELOW and abs(p.y_mm) < METRES_BELOW for p in poses))
    tools = {pose.tool for pose in poses}
    one = of_one_tip and len(tools - {None}) == 1
    found = {(pose.hand, pose.local, None if one else pose.tool) for pose in poses}
    return check_frames(found, allow_mixed_hand)


def check_frames(
    found: Collection[tuple[Hand | None, int, int | None]], allow_mixed_hand: bool
) -> tuple[str, ...]:
    """Refuse poses of frames or arms that do not belong together; return lesser doubts.

    Args:
        found: Hand, local and tool of the poses, each combination once.
        allow_mixed_hand: Whether different hands are a doubt only.

    Raises:
        CalibrationError: ``mixed_local``, ``mixed_tool``, ``tool_pose`` or ``mixed_hand``.
    """
    hands = {hand for hand, _, _ in found if hand is not None}
    _refuse_tools({tool for _, _, tool in found if tool is not None})
    if len({local for _, local, _ in found}) > 1:
        raise CalibrationError(
            "mixed_local",
            tr("The poses are given in different local coordinate systems."),
            remedy=tr("Give all of them in local 0, the base, or say what the locals are."),
            others=("local_pose",),
        )
    if len(hands) > 1 and not allow_mixed_hand:
        raise CalibrationError(
            "mixed_hand",
            tr("The poses were taken with different arm configurations."),
            remedy=tr(
                "Take all of them with the same hand, so that errors of the arm lengths cancel."
            ),
        )
    return ("mixed_hand",) if len(hands) > 1 else ()


def _refuse_tools(tools: Collection[int]) -> None:
    if len(tools) > 1:
        raise CalibrationError(
            "mixed_tool",
            tr("The poses were taken with different tools selected."),
            remedy=tr("Take all of them in Tool 0."),
            others=("tool_pose",),
        )
    for tool in tools:
        if tool:
            raise CalibrationError(
                "tool_pose",
                tr("These are positions of Tool {tool}, not of the flange.", tool=tool),
                remedy=tr("Say what Tool {tool} is, or take them in Tool 0.", tool=tool),
            )


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
            remedy=tr("Check that all poses touch the same point, are flange poses and in mm."),
            others=("suspect_units",),
        )
    return offset


def require_finite_poses(poses: Sequence[Pose]) -> None:
    """Refuse a coordinate that is no finite number.

    Raises:
        CalibrationError: ``non_finite``, with pose and name.
    """
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


def refuse_metres(near_the_axis: bool) -> None:
    """Refuse poses that all lie within 2 mm of the base axis.

    A flange of a robot that reaches over 100 mm never stays there; the size of the offset says
    nothing (docs/reference/calibration.md 3).

    Raises:
        CalibrationError: ``suspect_units``.
    """
    if near_the_axis:
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
