"""Paths of a tip to a place and away from it, without dragging it along; turning in the air.

One joint movement by half a turn would bring frame and angle to their ends on a way of its own:
half way the tip of a selected tool would be as far from its place as its offset is long. In short
turns it keeps to the arc, so that what is checked beforehand is where it goes.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

from robolink.errors import CalibrationError, ConfigError, LimitError
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, WorkBox
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import Move, Procedure, Seek

NO_OFFSET: Final = ToolOffset()


def approach_path(target: Pose, *, here: Pose, purpose: str) -> Procedure[None]:
    """Go somewhere without dragging the tip along: up first, over, then down.

    Args:
        target: Where to.
        here: Where the frame is now.
        purpose: What for, for a person.

    Example:
        >>> from robolink.model import Pose
        >>> from robolink.procedures import approach_path
        >>> here, target = Pose(300, 100, -40, 0), Pose(310, 95, 5, 0)
        >>> course = approach_path(target, here=here, purpose="To the pin.")
        >>> [(step.path.value, step.target.x_mm, step.target.z_mm) for step in course]
        [('straight', 300, 5), ('joint', 310, 5)]
    """
    top_mm = max(here.z_mm, target.z_mm)
    above = replace(target, z_mm=top_mm)
    if here.z_mm < top_mm:
        yield Move(replace(here, z_mm=top_mm), Path.STRAIGHT, purpose)
    if above.coordinates() != replace(here, z_mm=top_mm).coordinates():
        yield Move(above, Path.JOINT, purpose)
    if target.z_mm < top_mm:
        yield Move(target, Path.STRAIGHT, purpose)


def offset_z(pose: Pose, by_mm: float) -> Pose:
    """Return ``pose`` with Z higher by ``by_mm``."""
    x, y, z, u, v, w = pose.coordinates()
    return Pose(x, y, z + by_mm, u, v, w, pose.hand, pose.local, pose.tool, pose.posture)


def seek_or_retract(step: Seek, *, here: Pose, safe_z_mm: float) -> Procedure[Pose]:
    """Seek; without an edge, lift the frame straight up and raise the error.

    Args:
        step: What is sought.
        here: Where the frame is before.
        safe_z_mm: Height of the frame at which nothing is met.

    Raises:
        CalibrationError: ``no_edge`` or ``edge_passed``, with the tip drawn back.

    Example:
        >>> from robolink.errors import CalibrationError
        >>> from robolink.model import InputEdge, Pose, ToolOffset
        >>> from robolink.procedures import seek_or_retract
        >>> from robolink.runner import Seek
        >>> from robolink.testing import PaperCell
        >>> here = Pose(300, 100, 0, 0)
        >>> cell = PaperCell(here, ToolOffset())  # without a switch
        >>> step = Seek(Pose(300, 100, -5, 0), InputEdge(5), 2, "Looking for the plate.")
        >>> try:
        ...     cell.run(seek_or_retract(step, here=here, safe_z_mm=10))
        ... except CalibrationError as error:
        ...     print(error.code, cell.here.z_mm)
        no_edge 10
    """
    try:
        found: Pose = yield step
    except CalibrationError as error:
        stands = step.target if error.code == "no_edge" else here
        yield Move(replace(stands, z_mm=safe_z_mm), Path.STRAIGHT, tr("Backing away."))
        raise
    return found


SHORT_TURN_DEG: Final = 15.0
"""Largest short turn, degrees: up to it the chord differs from the arc by 0.9 % of the radius."""

_LOOK_DEG: Final = 1.0
"""Angle between two places that are checked, degrees: 0.5 mm at a radius of 30 mm."""

LONGEST_TURN_DEG: Final = 360.0

Place = tuple[float, float, float]


def turn_in_air(here: Pose, turn_deg: float, *, lift_mm: float) -> Procedure[None]:
    """Lift the current frame, turn it about itself, and leave it there.

    Args:
        here: Where it is.
        turn_deg: By how much U changes, with its sign.
        lift_mm: How far it is lifted first.

    Raises:
        ConfigError: The turn is none, or more than a whole one; or the lift is not positive.

    Example:
        >>> from robolink.model import Pose
        >>> from robolink.procedures import turn_in_air
        >>> course = list(turn_in_air(Pose(300, 100, -60, 0, tool=1), 180, lift_mm=10))
        >>> [(step.path.value, step.target.z_mm) for step in course[:2]]
        [('straight', -50), ('joint', -50)]
        >>> len(course), course[-1].target.u_deg
        (13, 180.0)
    """
    _require_turn(turn_deg, lift_mm)
    up = replace(here, z_mm=here.z_mm + lift_mm)
    yield Move(up, Path.STRAIGHT, tr("Lifting by {lift:g} mm.", lift=lift_mm))
    for part_deg in _parts(turn_deg, SHORT_TURN_DEG):
        target = replace(up, u_deg=here.u_deg + part_deg)
        yield Move(target, Path.JOINT, tr("Turning to U {u:.1f}.", u=target.u_deg))


def require_turn_inside(
    here: Pose,
    turn_deg: float,
    *,
    lift_mm: float,
    reach_mm: float,
    swings: Mapping[str, ToolOffset],
    tool: ToolOffset | None = None,
) -> None:
    """Refuse a turn during which the flange, or a tip, gets too far from where it is.

    Args:
        here: Where the selected frame is.
        turn_deg: By how much U changes.
        lift_mm: How far it is lifted first.
        reach_mm: How far from its own place each of them may get, in every direction.
        swings: The tips that are looked at: what each is called, and its offset from the flange.
        tool: The selected tool, about whose tip it turns; ``None`` for the flange.

    Raises:
        ConfigError: As :func:`turn_in_air`.
        LimitError: Names what would leave the area, at which angle.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import require_turn_inside
        >>> require_turn_inside(
        ...     Pose(300, 100, -60, 0), 180, lift_mm=10, reach_mm=50,
        ...     swings={"tip of tool 1": ToolOffset(12, -3.5, -20)},
        ... )
    """
    from robolink.calibration import rotation_of  # numpy, not needed for a command's help

    _require_turn(turn_deg, lift_mm)
    # In the selected frame, the tool's own offset leads back to the flange.
    frame = tool or ToolOffset()
    back = rotation_of(Pose(0.0, 0.0, 0.0, frame.u_deg, frame.v_deg, frame.w_deg)).T
    arms = {tr("flange"): ToolOffset(), **swings}

    def place(pose: Pose, offset: ToolOffset) -> Place:
        away = [b - a for a, b in zip(frame.components()[:3], offset.components()[:3], strict=True)]
        x, y, z = (rotation_of(pose) @ (back @ away)).tolist()
        return pose.x_mm + x, pose.y_mm + y, pose.z_mm + z

    for name, offset in arms.items():
        x_mm, y_mm, z_mm = place(here, offset)
        start = Pose(x_mm, y_mm, z_mm, here.u_deg)
        box = WorkBox.around(start, xy_mm=reach_mm, below_mm=reach_mm, above_mm=reach_mm)
        for part_deg in (0.0, *_parts(turn_deg, _LOOK_DEG)):
            pose = replace(here, z_mm=here.z_mm + lift_mm, u_deg=here.u_deg + part_deg)
            at = Pose(*place(pose, offset), pose.u_deg)
            if not box.holds(at):
                raise _outside(name, start, at, reach_mm)


def _parts(turn_deg: float, longest_deg: float) -> Iterator[float]:
    """Yield how far it has turned after each part, the last one exactly."""
    count = math.ceil(abs(turn_deg) / longest_deg - 1e-9)
    yield from (turn_deg * number / count for number in range(1, count + 1))


def _require_turn(turn_deg: float, lift_mm: float) -> None:
    if not 0 < abs(turn_deg) <= LONGEST_TURN_DEG:
        raise ConfigError(
            tr("{turn:g} degrees is not a possible turn.", turn=turn_deg),
            remedy=tr("Give up to {most:g} degrees, with its sign.", most=LONGEST_TURN_DEG),
        )
    if not lift_mm > 0:
        raise ConfigError(
            tr("The tool must be lifted before it turns."), remedy=tr("Give a height above 0 mm.")
        )


def _outside(name: str, start: Pose, at: Pose, reach_mm: float) -> LimitError:
    away_mm = max(
        abs(b - a) for a, b in zip(start.coordinates()[:3], at.coordinates()[:3], strict=True)
    )
    return LimitError(
        tr(
            "During the turn, at U {u:.0f}, the {name} would be {away:.1f} mm from its "
            "present place; {reach:g} mm is allowed. Nothing moved.",
            u=at.u_deg,
            name=name,
            away=away_mm,
            reach=reach_mm,
        ),
        remedy=tr(
            "Check what is around it, then allow more with {box}.",
            box=remedy_word(RemedyWord.BOX),
        ),
    )
