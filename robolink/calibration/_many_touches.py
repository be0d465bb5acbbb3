"""A tip touched onto a pin at several angles: live residuals, an early end, a pose taken again."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from robolink.calibration._planar_checks import planar_sigma_gain
from robolink.calibration._result import CalibrationResult
from robolink.calibration._steps import Ask, Offer, Procedure, Tell
from robolink.calibration._touch import TouchPlan, lift_off, touch_again
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg

MOST_RETAKES: Final = 3
"""How often a pose is offered to be taken again; after that the measurement stands as it is."""

LEAST_TO_STOP: Final = 4
"""Touches before an estimated scatter may end a measurement: from three it is a guess, and whoever
stops as soon as a guess is good stops too often on a lucky one."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a measurement with many touches goes on.

    Attributes:
        until_mm: End early when half the 95 % interval of X and of Y is at most this; ``None`` for
            taking all touches.
        retake: Offer to take the pose again that fits worst.
    """

    until_mm: float | None = None
    retake: bool = False


ALL_OF_THEM: Final = Course()


def n_angle(
    plan: TouchPlan,
    *,
    turns_deg: Sequence[float],
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    course: Course = ALL_OF_THEM,
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at several angles. Runs in Tool 0.

    After each touch from the third on it tells how well they agree, how sure the tip is, and how
    sure one more touch would make it.

    Args:
        plan: Lift and clearance.
        turns_deg: Angles of the further touches, counted from the first one.
        stored: The offset stored now; the approaches use it.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
        course: When it ends, and whether a pose may be taken again.

    Raises:
        CalibrationError: As :func:`solve_n_angle`.
    """
    from robolink.calibration._n_angle import solve_n_angle  # numpy, not for --help

    guess = stored or ToolOffset()
    first: Pose = yield Ask(tr("Bring the tip onto the pin."))
    yield lift_off(plan, first)
    touches = [first]
    # Within half a turn of zero: adding up from touch to touch leaves the joint's range.
    angles = [angle_difference_deg(first.u_deg + turn_deg, 0.0) for turn_deg in turns_deg]
    for u_deg, following in [*pairwise(angles), (angles[-1], None)]:
        touches.append((yield from touch_again(plan, touches[-1], u_deg, guess)))
        if len(touches) < 3:
            continue
        try:
            fit = solve_n_angle(touches, stored=stored, sigma_mm=sigma_mm)
        except CalibrationError:
            # What is too little now may be enough in the end.
            continue
        yield Tell(_progress(fit, touches, following))
        if following is not None and _enough(fit, course.until_mm):
            yield Tell(tr("That is enough: {count} touches were taken.", count=len(touches)))
            break
    result = solve_n_angle(touches, stored=stored, sigma_mm=sigma_mm)
    for _ in range(MOST_RETAKES if course.retake and result.residuals_mm else 0):
        worst = worst_pose(result)
        if not (yield Offer(_offer(result, worst))):
            break
        again = yield from touch_again(plan, touches[-1], touches[worst].u_deg, guess)
        # The last one taken is where the tip stands, so that the next way begins there.
        touches = [*touches[:worst], *touches[worst + 1 :], again]
        result = solve_n_angle(touches, stored=stored, sigma_mm=sigma_mm)
        yield Tell(_progress(result, touches, None))
    return result


def telling_order(turns_deg: Sequence[float]) -> tuple[float, ...]:
    """Return the same angles, those first that tell the most together with the ones before.

    The first touch is at 0. Whoever ends early then ends with angles that are spread well.
    """
    chosen, left = [0.0], list(turns_deg)
    while left:
        best = min(left, key=lambda turn: (round(_gain([*chosen, turn]), 9), left.index(turn)))
        left.remove(best)
        chosen.append(best)
    return tuple(chosen[1:])


def worst_pose(result: CalibrationResult) -> int:
    """Return the index of the pose with the largest residual."""
    distances = result.residual_distances_mm
    return distances.index(max(distances))


def _enough(fit: CalibrationResult, until_mm: float | None) -> bool:
    if until_mm is None or (len(fit.inputs) < LEAST_TO_STOP and not fit.sigma_stated):
        return False
    return bool(fit.half_width95) and max(fit.half_width95) <= until_mm


def _progress(fit: CalibrationResult, touches: Sequence[Pose], following: float | None) -> str:
    """Return what the touches so far say, in one sentence."""
    told = tr(
        "{count} touches agree within {rms:.3f} mm rms, the last within {last:.3f} mm; X and Y are "
        "known to +-{half:.3f} mm.",
        count=len(touches),
        rms=fit.rms_mm,
        last=fit.residual_distances_mm[-1],
        half=max(fit.half_width95),
    )
    if following is None or fit.sigma_mm is None:
        return told
    foreseen = Pose(0.0, 0.0, 0.0, following)
    better = planar_sigma_gain([*touches, foreseen]) / planar_sigma_gain(touches)
    gain = tr(
        "One more, at U {u:.0f}, leaves {share:.0f} % of that.", u=following, share=100 * better
    )
    return f"{told} {gain}"


def _offer(result: CalibrationResult, worst: int) -> str:
    return tr(
        "Pose {number}, at U {u:.1f}, fits worst: it is {distance:.3f} mm off. Take it again?",
        number=worst + 1,
        u=result.inputs[worst].u_deg,
        distance=result.residual_distances_mm[worst],
    )


def _gain(turns_deg: Sequence[float]) -> float:
    return planar_sigma_gain([Pose(0.0, 0.0, 0.0, turn) for turn in turns_deg])
