"""Six points with a person: a pivot, then two ways along the tool's own axes, in the air.

The ways start where the person finds room for them. Along +Z from the pin itself a tool that
points down would be driven into whatever the pin stands on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from robolink.calibration import (
    FAR_DEG,
    GOOD_WAY_MM,
    Floats,
    SixPointResult,
    axis_displacement,
    between_deg,
    require_unturned,
    rotation_of,
    solve_six_point,
    stated_mm,
)
from robolink.errors import CalibrationError
from robolink.messages import joined, tr
from robolink.methods.pivot.procedure import pivot_then_lift, retake_pivot
from robolink.methods.pivot.tilts import Tilt
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import TAKE_ALL, SamplingPolicy, TouchPlan, approach_path, offset_z
from robolink.runner import Ask, Confirm, Move, Notify, Procedure, TeachPrompt, TouchedAt

_SIDE_DEG: Final = 90.0

MOST_SHOWINGS: Final = 3
"""How often a person is asked for the same thing before the refusal ends the measurement."""


@dataclass(frozen=True, slots=True)
class AxisTeachPlan:
    """Which ways a person shows, and how long they are.

    Attributes:
        length_mm: Least length of each.
        second_is: ``z``: the second one goes along the tool's +Z; ``xz``: anywhere in its XZ
            plane, on the side of +Z.
    """

    length_mm: float = GOOD_WAY_MM
    second_is: Literal["z", "xz"] = "z"


def measure_six_point(
    plan: TouchPlan,
    ways: AxisTeachPlan,
    *,
    tilts: Sequence[Tilt],
    stored: ToolOffset,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> Procedure[SixPointResult]:
    """Measure a whole tool frame. Runs in Tool 0.

    The touches go as in :func:`measure_pivot`. Then the person shows the axes. A way that cannot
    be used is said at once, and the person goes on from where the tool stands. Ways that are not
    square are both asked for again; those that are a little askew may be. It ends as
    :func:`measure_pivot` does.

    Args:
        plan: Lift and clearance.
        ways: The ways along the axes.
        tilts: Orientations of the further touches.
        stored: The offset stored now. Its orientation only says about where a way will lead, and
            which one is worth a question.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        sampling: When the touches end, and whether one may be taken again.

    Raises:
        CalibrationError: ``turned_on_the_way``, ``short_axis`` and ``axes_not_square`` when the
            person was told so three times; and as :func:`measure_pivot`.

    Example:
        >>> from robolink.methods import AxisTeachPlan, informative_tilts, measure_six_point
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> true, stored = ToolOffset(12.3, -3.9, -20.6, 9), ToolOffset(12, -4, -20, 10)
        >>> cell = PaperCell(Pose(300, 100, 20, 0), true, (310, 95, -40))
        >>> found = cell.run(
        ...     measure_six_point(
        ...         TouchPlan(), AxisTeachPlan(), tilts=informative_tilts(6, 30), stored=stored
        ...     )
        ... )
        >>> round(found.offset.z_mm, 3), round(found.offset.u_deg, 3)
        (-20.6, 9.0)
    """
    fit, lifted = yield from pivot_then_lift(
        plan, tilts=tilts, stored=stored, sigma_mm=sigma_mm, sampling=sampling
    )
    showing = _AxisTeaching(ways, lifted, stored)
    start = yield from showing.start()
    for left in reversed(range(MOST_SHOWINGS)):
        along_x = yield from showing.along(start, TeachPrompt.ALONG_X)
        second = yield from showing.along(start, TeachPrompt.ALONG_Z)
        try:
            result = solve_six_point(
                fit.inputs,
                along_x,
                second,
                start=start,
                second_is=ways.second_is,
                stored=stored,
                sigma_mm=sigma_mm,
            )
        except CalibrationError as error:
            if error.code != "axes_not_square" or not left:
                raise
            yield Notify(str(error))
            continue
        yield Notify(_uncertainty(result))
        askew = "ways_askew" in result.warnings
        if not left or not askew or not (yield Confirm(tr("Show both moves again?"))):
            break
    yield from approach_path(lifted, here=start, purpose=tr("Moving back above the pin."))
    return result


def retake_six_point(
    plan: TouchPlan,
    ways: AxisTeachPlan,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int | None,
    tilts: Sequence[Tilt],
    stored: ToolOffset,
    sigma_mm: float | None = None,
) -> Procedure[SixPointResult]:
    """Make one touch of :func:`measure_six_point` again. Runs in Tool 0, ends as it does.

    The ways along the axes stay as they were shown: they begin and end away from the pin.

    Args:
        plan: Lift and clearance.
        ways: The ways along the axes.
        here: Where the flange is, upright.
        taken: The touches of the measurement, then the start and the ends of the ways.
        again: Index of the touch that is made again; ``None`` for the last one.
        tilts: Orientations of the plan.
        stored: The offset stored now.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.

    Raises:
        CalibrationError: As :func:`measure_six_point`.
    """
    *touches, start, along_x, second = taken
    fit = yield from retake_pivot(
        plan,
        here=here,
        taken=touches,
        again=len(touches) - 1 if again is None else again,
        tilts=tilts,
        stored=stored,
        sigma_mm=sigma_mm,
    )
    result = solve_six_point(
        fit.inputs,
        along_x,
        second,
        start=start,
        second_is=ways.second_is,
        stored=stored,
        sigma_mm=sigma_mm,
    )
    yield Notify(_uncertainty(result))
    return result


@dataclass(frozen=True, slots=True)
class _AxisTeaching:
    """Asks a person for poses that show the axes of a tool.

    Attributes:
        ways: The ways along the axes.
        lifted: Where the flange stands at first; its orientation is kept.
        stored: The offset stored now.
    """

    ways: AxisTeachPlan
    lifted: Pose
    stored: ToolOffset

    def start(self) -> Procedure[Pose]:
        """Have the tool brought to where both ways start."""
        lowest_mm = min(
            self._foreseen_mm(way)[2] for way in (TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z)
        )
        ask = Ask(
            tr(
                "Jog the tip, without turning it, to where it is free to go {length:g} mm "
                "along the tool's own +X, and {length:g} mm along its own +Z.",
                length=self.ways.length_mm,
            ),
            TeachPrompt.ROOM,
            offset_z(self.lifted, max(0.0, -lowest_mm)),
        )
        return (yield from _shown(ask, lambda pose: require_unturned(self.lifted, pose)))

    def along(self, start: Pose, way: TeachPrompt) -> Procedure[Pose]:
        """Have one way shown; the flange is back at ``start`` then."""
        dx_mm, dy_mm, dz_mm = self._foreseen_mm(way).tolist()
        foreseen = replace(
            start, x_mm=start.x_mm + dx_mm, y_mm=start.y_mm + dy_mm, z_mm=start.z_mm + dz_mm
        )
        ask = Ask(self._instruction(way), way, foreseen)
        for left in reversed(range(MOST_SHOWINGS)):
            end = yield from _shown(
                ask, lambda pose: axis_displacement(start, pose, wanted_mm=self.ways.length_mm)
            )
            yield Move(start, Path.STRAIGHT, tr("Moving back to where the move began."))
            if not left or not (yield from self._doubted(start, end, way)):
                break
        return end

    def _doubted(self, start: Pose, end: Pose, way: TeachPrompt) -> Procedure[bool]:
        """Return whether a way leads far from its axis as it is stored, and is to be shown again.

        A way in a plane may lead anywhere on its side.
        """
        turn = rotation_of(start)
        far_deg = between_deg(turn @ axis_displacement(start, end), self._foreseen_mm(way))
        in_plane = way is TeachPrompt.ALONG_Z and self.ways.second_is == "xz"
        if far_deg <= (_SIDE_DEG if in_plane else FAR_DEG):
            return False
        again: bool = yield Confirm(
            tr(
                "This move leads {angle:.0f} degrees away from {axis} as it is "
                "stored. Show it again?",
                angle=far_deg,
                axis="+X" if way is TeachPrompt.ALONG_X else "+Z",
            )
        )
        return again

    def _foreseen_mm(self, way: TeachPrompt) -> Floats:
        """Return a way in the base, as the stored orientation has it."""
        own = rotation_of(Pose(0.0, 0.0, 0.0, *self.stored.components()[3:]))
        axis = rotation_of(self.lifted) @ own[:, 0 if way is TeachPrompt.ALONG_X else 2]
        foreseen: Floats = self.ways.length_mm * axis
        return foreseen

    def _instruction(self, way: TeachPrompt) -> str:
        length_mm = self.ways.length_mm
        if way is TeachPrompt.ALONG_X:
            return tr(
                "Jog the tip {length:g} mm or more along the tool's own +X, without turning it.",
                length=length_mm,
            )
        if self.ways.second_is == "z":
            return tr(
                "Jog the tip {length:g} mm or more along the tool's own +Z, without turning it.",
                length=length_mm,
            )
        return tr(
            "Jog the tip {length:g} mm or more in the tool's own XZ plane, on the side of its +Z, "
            "without turning it.",
            length=length_mm,
        )


def _shown(ask: Ask, check: Callable[[Pose], object]) -> Procedure[Pose]:
    """Ask for a pose until it passes; the person goes on from where the tool stands.

    Raises:
        CalibrationError: That of ``check``, the third time.
    """
    for _ in range(MOST_SHOWINGS - 1):
        pose: Pose = yield ask
        try:
            check(pose)
        except CalibrationError as error:
            yield Notify(str(error))
        else:
            return pose
    last: Pose = yield ask
    check(last)
    return last


def _uncertainty(result: SixPointResult) -> str:
    """Return how well the ways agree with each other, in one sentence."""
    half_deg = max(result.half_width95[3:], default=None)
    off_deg = result.off_square_deg
    if off_deg is None:
        said = tr("The moves show the axes.")
    else:
        said = tr("The moves are {off:.2f} degrees off a right angle.", off=abs(off_deg))
    if half_deg is None:
        return said
    if "ways_askew" in result.warnings:
        doubted = tr("The touches explain less than that: a move was not quite along its axis.")
        return joined(" ", (said, doubted))
    known = tr("U, V and W: repeatable to +-{half} degrees (95 %).", half=stated_mm(half_deg))
    return joined(" ", (said, known))
