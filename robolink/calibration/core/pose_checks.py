"""Checks that name what makes poses and other numbers unfit (docs/reference/calibration.md 3)."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import COMPONENTS, Hand, Pose, ToolOffset

MAX_OFFSET_MM = 1000.0
"""Longest plausible tool, in mm (docs/reference/calibration.md 3)."""

METRES_BELOW = 2.0
"""If X and Y of all poses are smaller than this, the poses are in metres: no flange works so close,
in mm, to the axis of its base."""

MIN_ROTATION_DEG = 30.0

WARN_ROTATION_DEG = 90.0

_SAME_ANGLE_DEG = 1e-9

_LIKE_A_NEEDLE_MM = 150.0

UPRIGHT_WITHIN_DEG = 0.01
"""Largest lean of an upright flange: with a tool of 120 mm it moves the tip by 0.02 mm."""


_P = ParamSpec("_P")
_R = TypeVar("_R")


def refuses_by_name(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Let a function say which argument is no ``Pose``, ``ToolOffset`` or other value it takes.

    Its arguments are looked at when it has failed, so what is right costs nothing. It is for
    functions that only calculate: what sends looks first (:func:`robolink.model.not_of_class`).
    """

    @wraps(function)
    def refusing(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            return function(*args, **kwargs)
        except (AttributeError, TypeError) as error:
            from robolink.model import misgiven

            for wrong in misgiven(function, args, kwargs):
                raise wrong from error
            raise

    return refusing


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
    hands, locals_ = {pose.hand for pose in poses}, {pose.local for pose in poses}
    return check_frames(hands, locals_, {None} if one else tools, allow_mixed_hand=allow_mixed_hand)


def check_frames(
    hands: Collection[Hand | None],
    locals_: Collection[int],
    tools: Collection[int | None],
    *,
    allow_mixed_hand: bool,
) -> tuple[str, ...]:
    """Refuse poses of frames or arms that do not belong together; return lesser doubts.

    Args:
        hands: Of the poses, each once; ``None`` where a pose tells none.
        locals_: Their local coordinate systems, each once.
        tools: Their tools, each once; ``None`` where a pose tells none.
        allow_mixed_hand: Whether different hands are a doubt only.

    Raises:
        CalibrationError: ``mixed_local``, ``mixed_tool``, ``tool_pose`` or ``mixed_hand``.
    """
    _refuse_tools({tool for tool in tools if tool is not None})
    if len(locals_) > 1:
        raise CalibrationError(
            "mixed_local",
            tr("The poses are given in different local coordinate systems."),
            remedy=tr("Give all of them in local 0, the base, or state the locals."),
            others=("local_pose",),
        )
    mixed = len({hand for hand in hands if hand is not None}) > 1
    if mixed and not allow_mixed_hand:
        raise CalibrationError(
            "mixed_hand",
            tr("The poses were taken with different arm configurations."),
            remedy=tr(
                "Record all of them with the same hand, so that errors of the arm lengths cancel."
            ),
        )
    return ("mixed_hand",) if mixed else ()


def _refuse_tools(tools: Collection[int]) -> None:
    if len(tools) > 1:
        raise CalibrationError(
            "mixed_tool",
            tr("The poses were taken with different tools selected."),
            remedy=tr("Record all of them in Tool 0."),
            others=("tool_pose",),
        )
    for tool in tools:
        if tool:
            raise CalibrationError(
                "tool_pose",
                tr("These are positions of Tool {tool}, not of the flange.", tool=tool),
                remedy=tr(
                    "State the value of Tool {tool}, or record the poses in Tool 0.", tool=tool
                ),
            )


def keep_unmeasured(stored: ToolOffset | None, **measured: float) -> ToolOffset:
    """Return ``stored`` with the measured components replaced.

    Raises:
        CalibrationError: ``implausible_offset`` when it is longer than any tool.
    """
    offset = ToolOffset(**measured) if stored is None else replace(stored, **measured)
    longest = math.hypot(offset.x_mm, offset.y_mm, offset.z_mm)
    if longest > MAX_OFFSET_MM:
        raise CalibrationError(
            "implausible_offset",
            tr(
                "The offset would be {longest:.1f} mm long; the limit is {limit:.0f} mm.",
                longest=longest,
                limit=MAX_OFFSET_MM,
            ),
            remedy=tr(
                "Check that all poses touch the same point, are flange poses, and are in mm."
            ),
            others=("suspect_units",),
        )
    return offset


def components(stored: ToolOffset | None, **measured: float) -> dict[str, Any]:
    """Return the components of a result: the offset, which were measured, which not.

    Args:
        stored: The offset stored now; what was not measured is kept from it, or 0 without one.
        measured: The components that were measured.

    Raises:
        CalibrationError: ``implausible_offset``.
    """
    others = tuple(name for name in COMPONENTS if name not in measured)
    return {
        "offset": keep_unmeasured(stored, **measured),
        "measured": tuple(measured),
        "kept": others,
        "unobservable": others,
    }


def require_finite_poses(poses: Sequence[Pose]) -> None:
    """Refuse a coordinate that is not finite.

    Raises:
        CalibrationError: ``non_finite``, with pose and name.
    """
    for number, pose in enumerate(poses, start=1):
        if all(type(value) is float and math.isfinite(value) for value in pose.coordinates()):
            continue  # the usual case; another type of number may be finite too
        for name, value in zip(COMPONENTS, pose.coordinates(), strict=True):
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
    """Refuse a value that is not finite, by its name.

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


def check_planar(
    poses: Sequence[Pose], *, minimum: int, min_rotation_deg: float, allow_mixed_hand: bool
) -> tuple[str, ...]:
    """Refuse poses that a planar solver cannot use; return the names of lesser doubts.

    Raises:
        CalibrationError: ``too_few_poses``, ``tilted_pose``, ``degenerate_angles``,
            ``insufficient_rotation``, and those of ``check_poses``.
    """
    require_poses(len(poses), minimum)
    doubts = check_poses(poses, allow_mixed_hand=allow_mixed_hand)
    require_upright(poses)
    spread_deg = angle_spread_deg([heading_deg(pose) for pose in poses])
    return (*doubts, *check_rotation(poses, spread_deg, min_rotation_deg))


def check_rotation(
    poses: Sequence[Pose], spread_deg: float, min_rotation_deg: float
) -> tuple[str, ...]:
    """Refuse poses that turn too little; return the names of lesser doubts.

    Raises:
        CalibrationError: ``degenerate_angles``, ``insufficient_rotation``, ``suspect_units``.
    """
    if spread_deg < min_rotation_deg:
        refuse_radians(poses, spread_deg)
    _require_rotation(poses, spread_deg, min_rotation_deg)
    return ("small_rotation",) if spread_deg < WARN_ROTATION_DEG else ()


def heading_deg(pose: Pose) -> float:
    """Return the angle about Z at which the flange's X points, of an upright flange.

    This is U, and half a turn more where V is 180: Rz(U) Ry(180) turns X over.
    """
    return pose.u_deg if math.cos(math.radians(pose.v_deg)) >= 0.0 else pose.u_deg + 180.0


def require_upright(poses: Sequence[Pose]) -> None:
    """Refuse a leaning flange, and one that is upside down in only some poses.

    Raises:
        CalibrationError: ``tilted_pose`` when a pose leans by 0.01 degrees or more, or some stand
            on their head and some do not.
    """
    down = set()
    for number, pose in enumerate(poses, start=1):
        if tilted(pose):
            raise tilted_pose(number, pose)
        down.add(on_its_head(pose))
    if len(down) > 1:
        raise some_on_their_head()


def tilted(pose: Pose) -> bool:
    """Return whether the tool leans from the base's Z, either way up."""
    return lean_deg(_upward(pose)) >= UPRIGHT_WITHIN_DEG


def on_its_head(pose: Pose) -> bool:
    """Return whether the flange's Z points down (W or V is 180).

    X and Y of the tip can be told as well then; one sign differs (docs/reference/evidence.md 3).
    """
    return _upward(pose) < 0


def _upward(pose: Pose) -> float:
    """Return the third component of the flange's Z, R33."""
    if pose.v_deg == 0.0 and pose.w_deg == 0.0:
        return 1.0
    return math.cos(math.radians(pose.v_deg)) * math.cos(math.radians(pose.w_deg))


def lean_deg(upward: float) -> float:
    """Return how far a flange leans from the vertical, up or down.

    Args:
        upward: Third component of its Z, R33.
    """
    return math.degrees(math.acos(min(abs(upward), 1.0)))


def tilted_pose(number: int, pose: Pose) -> CalibrationError:
    """Return the error for a pose that leans."""
    return CalibrationError(
        "tilted_pose",
        tr(
            "Pose {number} has V = {v} and W = {w}; a planar method needs an upright flange.",
            number=number,
            v=pose.v_deg,
            w=pose.w_deg,
        ),
        remedy=tr("Use the pivot method for poses of six axes."),
    )


def some_on_their_head() -> CalibrationError:
    """Return the error for poses of which only some are upside down."""
    return CalibrationError(
        "tilted_pose",
        tr("In some poses the flange points up and in others down."),
        remedy=tr("Use the pivot method for poses of six axes."),
    )


def angle_spread_deg(angles_deg: Sequence[float]) -> float:
    """Return the shortest arc that holds all angles, modulo 360."""
    turned = sorted(angle % 360.0 for angle in angles_deg)
    gaps = [b - a for a, b in zip(turned, [*turned[1:], turned[0] + 360.0], strict=True)]
    return 360.0 - max(gaps)


@refuses_by_name
def planar_sigma_gain(poses: Sequence[Pose]) -> float:
    """Return how much a placement error counts in each offset axis; inf if undetermined."""
    angles = [math.radians(heading_deg(pose)) for pose in poses]
    cosines, sines = [math.cos(angle) for angle in angles], [math.sin(angle) for angle in angles]
    mean_c, mean_s = sum(cosines) / len(poses), sum(sines) / len(poses)
    weight = sum((c - mean_c) ** 2 for c in cosines) + sum((s - mean_s) ** 2 for s in sines)
    return 1 / math.sqrt(weight) if weight > 0 else math.inf


def require_poses(count: int, minimum: int) -> None:
    """Refuse fewer than ``minimum`` poses.

    Raises:
        CalibrationError: ``too_few_poses``.
    """
    if count < minimum:
        raise CalibrationError(
            "too_few_poses",
            tr(
                "{count} poses were given; the method needs at least {minimum}.",
                count=count,
                minimum=minimum,
            ),
            remedy=tr("Record more, at angles as different as the robot allows."),
        )


def refuse_radians(poses: Sequence[Pose], spread_deg: float) -> None:
    """Refuse angles that imply a giant tool, and a plausible one when read as radians.

    Raises:
        CalibrationError: ``suspect_units``.
    """
    angles = [angle for pose in poses for angle in pose.coordinates()[3:]]
    if spread_deg < _SAME_ANGLE_DEG or any(abs(angle) > 2 * math.pi for angle in angles):
        return
    positions = [pose.coordinates()[:3] for pose in poses]
    # The distance between any two poses is at most twice the largest distance from the first.
    travel_mm = max(math.dist(positions[0], position) for position in positions)
    if travel_mm / (2 * math.sin(math.radians(spread_deg / 2))) > _LIKE_A_NEEDLE_MM:
        raise CalibrationError(
            "suspect_units",
            tr("The poses are {travel:.1f} mm apart but hardly turn.", travel=travel_mm),
            remedy=tr("The angles look like radians; give them in degrees."),
        )


def _require_rotation(poses: Sequence[Pose], spread_deg: float, minimum_deg: float) -> None:
    if spread_deg < _SAME_ANGLE_DEG:
        raise CalibrationError(
            "degenerate_angles",
            tr("All poses have the same U; they do not determine the offset."),
            remedy=tr("Turn the tool between the poses, best over half a turn or more."),
        )
    if spread_deg < minimum_deg:
        raise CalibrationError(
            "insufficient_rotation",
            tr(
                "U turned only {spread:.0f} degrees between the touches: every error would "
                "count {gain:.1f} times.",
                spread=spread_deg,
                gain=planar_sigma_gain(poses),
            ),
            remedy=tr("Spread them over {minimum:.0f} degrees or more.", minimum=minimum_deg),
        )
