"""Samples taken in sequence: live residuals, an early end, the worst one repeated."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import LEAST_HALF_WIDTH, MOST_RESIDUAL_MM, CalibrationResult, stated_mm
from robolink.errors import CalibrationError
from robolink.messages import joined, tr
from robolink.procedures.samples import (
    AddsSamples,
    PlaceT,
    ResultT,
    Sampler,
    Samples,
    SequentialSampler,
    TakenT,
)
from robolink.runner import MORE, Confirm, FitRow, FitSubject, Notify, Procedure

MOST_REPEATED: Final = 3
"""How often repeating a sample is offered; after that the measurement stands."""

_DIGITS: Final = 6
"""Number of decimals of a residual in mm; residuals equal in these differ only by rounding."""


def finalize_samples(
    method: Sampler[PlaceT, TakenT, ResultT],
    places: Sequence[PlaceT],
    taken: Sequence[TakenT],
    *,
    retake: bool,
) -> Procedure[ResultT]:
    """Return the result of all samples; the worst may have been repeated. Ends lifted.

    Args:
        method: How it is taken and solved.
        places: Where it was taken.
        taken: What was taken there.
        retake: Whether the one that fits worst is offered to be taken again.

    Raises:
        CalibrationError: Those of ``method``.

    Example:
        >>> from robolink.calibration import solve_camera_round
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import CameraDrive, CameraSamples, LookPlan, Place
        >>> from robolink.procedures import finalize_samples
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> camera = CameraStation(300, 80, -30)
        >>> def solve(looks):
        ...     return solve_camera_round([camera.sighting(look) for look in looks], stored=tip)
        >>> looks = CameraSamples(CameraDrive(camera, LookPlan(), here), solve, here)
        >>> cell, places = PaperCell(here, tip), [Place(0, tip), Place(60, tip), Place(120, tip)]
        >>> seen = [cell.run(looks.take(place)) for place in places]
        >>> cell.run(finalize_samples(looks, places, seen, retake=True)).dof
        2
        >>> cell.here.z_mm  # lifted
        0.0
    """
    yield from method.away()
    samples, times = Samples(method, places, taken), Counter[int]()
    also = (MORE,) if isinstance(method, AddsSamples) else ()
    result = samples.solved()
    for _ in range(MOST_REPEATED if retake and result.dof else 0):
        worst = worst_of(result, times)
        question = tr(
            "{which} is {distance:.3f} mm off. Repeat it?",
            which=method.which(worst + 1, samples.taken[worst]),
            distance=result.residual_distances_mm[worst],
        )
        shown = fit_subject(method, result, samples.taken, worst=worst)
        offer = Confirm(question, fit=replace(shown, more=bool(also)), also=also)
        said: bool | str = yield offer
        if not said:
            break
        if said == MORE:
            if not (yield from samples.another()):
                continue
            worst = len(samples.taken) - 1
        else:
            times[worst] += 1
            yield from samples.take(worst)
        yield from method.away()
        result = samples.solved()
        yield Notify(agreement(method, result, last=worst))
    return result


def resume_samples(
    method: Sampler[PlaceT, TakenT, ResultT],
    places: Sequence[PlaceT],
    taken: Sequence[TakenT],
    again: int | None,
) -> Procedure[ResultT]:
    """Repeat one sample, or add one, in a measurement that has ended. Ends lifted.

    All others stay as they are.

    Args:
        method: How it is taken and solved.
        places: Where those so far were taken.
        taken: What was taken there.
        again: Index of the one that is taken again; ``None`` for one more.

    Raises:
        CalibrationError: Those of ``method``.

    Example:
        >>> from robolink.calibration import solve_camera_round
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import CameraDrive, CameraSamples, LookPlan, Place
        >>> from robolink.procedures import resume_samples
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> camera = CameraStation(300, 80, -30)
        >>> def solve(looks):
        ...     return solve_camera_round([camera.sighting(look) for look in looks], stored=tip)
        >>> looks = CameraSamples(CameraDrive(camera, LookPlan(), here), solve, here)
        >>> cell, places = PaperCell(here, tip), [Place(0, tip), Place(60, tip), Place(120, tip)]
        >>> seen = [cell.run(looks.take(place)) for place in places]
        >>> len(cell.run(resume_samples(looks, places, seen, again=1)).inputs)
        3
    """
    samples = Samples(method, places, taken)
    if again is None:
        yield from samples.another()
    else:
        yield from samples.take(again)
    yield from method.away()
    result = samples.solved()
    if result.dof:
        last = len(samples.taken) - 1 if again is None else again
        yield Notify(agreement(method, result, last=last))
    return result


def worst_of(result: CalibrationResult, times: Mapping[int, int]) -> int:
    """Return the index of the one that fits worst.

    Args:
        result: What they say.
        times: How often each was taken again.
    """
    distances = result.residual_distances_mm
    # Two samples that only check each other fit equally badly; then the other one is next.
    return min(
        range(len(distances)), key=lambda i: (-round(distances[i], _DIGITS), times.get(i, 0))
    )


def agreement(
    method: Sampler[PlaceT, TakenT, ResultT], fit: CalibrationResult, *, last: int
) -> str:
    """Return how well the samples so far agree, and what the tip is repeatable to.

    What it is accurate to is judged once, when it was measured.

    Args:
        method: How they are named.
        fit: What they say; it has a degree of freedom.
        last: Index of the one that was taken last.

    Example:
        >>> from robolink.calibration import solve_n_angle
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import agreement
        >>> class Touches:  # in full: robolink.procedures.Sampler
        ...     known = "X and Y"
        ...     def counted(self, count):
        ...         return f"{count} touches"
        >>> places = [(298, 99, 0), (306, 83, 90), (322, 91, 180), (314, 107, 270)]
        >>> flange = [Pose(x, y, -20, u_deg) for x, y, u_deg in places]
        >>> fit = solve_n_angle(flange, stored=ToolOffset(12, -4, -20))
        >>> agreement(Touches(), fit, last=3)[:50]
        '4 touches agree within 0.000 mm; the last is 0.000'
    """
    agree = tr(
        "{counted} agree within {rms:.3f} mm; the last is {last:.3f} mm off.",
        counted=method.counted(len(fit.residuals_mm)),
        rms=fit.rms_mm,
        last=fit.residual_distances_mm[last],
    )
    within_mm = fit.repeatable_to_mm
    if within_mm is None:
        return agree
    repeatable = tr(
        "{known}: repeatable to +-{within} mm (95 %).",
        known=method.known,
        within=stated_mm(within_mm),
    )
    return joined(" ", (agree, repeatable))


def fit_subject(
    method: Sampler[PlaceT, TakenT, ResultT],
    fit: CalibrationResult,
    taken: Sequence[TakenT],
    *,
    worst: int | None = None,
) -> FitSubject:
    """Return what a screen shows of a fit.

    Args:
        method: How samples are named.
        fit: What they say; it has a degree of freedom.
        taken: The samples, in the order of the fit.
        worst: Index of the one that is offered to be taken again.
    """
    rows = tuple(
        FitRow(number, method.which(number, one), off)
        for number, (one, off) in enumerate(zip(taken, fit.residuals_mm, strict=True), start=1)
    )
    return FitSubject(
        rows,
        fit.rms_mm,
        repeatable_mm=fit.repeatable_to_mm,
        worst=worst,
        limit_mm=MOST_RESIDUAL_MM,
    )


LEAST_DOF_TO_STOP: Final = 4
"""Smallest number of degrees of freedom from which an estimated scatter may end a measurement: that
of four touches of a pin at different U. With fewer the estimate is a guess, and stopping at the
first good guess too often means stopping at a lucky one."""


@dataclass(frozen=True, slots=True)
class SamplingPolicy:
    """How a measurement with many touches or crossings continues.

    Attributes:
        until_mm: End early when the tip is repeatable to this, in 95 %
            (:attr:`~robolink.calibration.CalibrationResult.repeatable_to_mm`): further touches
            make nothing else smaller. ``None`` for taking all.
        retake: Offer to take the one again that fits worst.
    """

    until_mm: float | None = None
    retake: bool = False


TAKE_ALL: Final = SamplingPolicy()


def sample_sequentially(
    method: SequentialSampler[PlaceT, TakenT, ResultT],
    first: TakenT,
    places: Sequence[PlaceT],
    sampling: SamplingPolicy,
) -> Procedure[ResultT]:
    """Take all after the first, and return their result. Ends lifted.

    As soon as they check each other it tells after each how well they agree, what the tip is
    repeatable to, and what one more would make of that.

    Args:
        method: What is done at each place.
        first: The first one taken.
        places: Where all are taken, the first one too.
        sampling: When it ends, and whether one may be taken again.

    Raises:
        CalibrationError: Those of ``method``.

    Example:
        >>> from robolink.calibration import solve_camera_round
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TAKE_ALL, CameraDrive, CameraSamples, LookPlan, Place
        >>> from robolink.procedures import sample_sequentially
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> camera = CameraStation(300, 80, -30)
        >>> class Looks(CameraSamples):  # implements SequentialSampler
        ...     def foreseen(self, place):
        ...         return place
        ...     def gain(self, taken):
        ...         return len(taken) ** -0.5
        ...     def named(self, place):
        ...         return f"U {place.u_deg}"
        >>> def solve(looks):
        ...     return solve_camera_round([camera.sighting(look) for look in looks], stored=tip)
        >>> looks = Looks(CameraDrive(camera, LookPlan(), here), solve, here)
        >>> cell = PaperCell(here, tip)
        >>> places = [Place(u_deg, tip) for u_deg in (0, 60, 120, 180)]
        >>> found = cell.run(
        ...     sample_sequentially(looks, cell.run(looks.take(places[0])), places, TAKE_ALL)
        ... )
        >>> len(found.inputs), "4 looks agree" in cell.told[-1]
        (4, True)
    """
    samples = Samples(method, places, [first])
    taken = samples.taken
    for number in range(2, len(places) + 1):
        yield from samples.take(number - 1)
        try:
            fit = samples.solved()
        except CalibrationError:
            # Too few samples now may be enough at the end.
            continue
        if not fit.dof:
            continue
        following = None if number == len(places) else method.foreseen(places[number])
        yield _progress(method, fit, taken, following)
        if following is not None and _enough(fit, sampling.until_mm):
            counted = method.counted(len(taken))
            yield Notify(tr("That is enough: {counted} were taken.", counted=counted))
            break
    return (yield from finalize_samples(method, places, taken, retake=sampling.retake))


def may_end_early(count: int, *, unknowns: int, sigma_stated: bool) -> bool:
    """Return whether a measurement of ``count`` coordinates can be good enough early.

    Args:
        count: How many coordinates are measured.
        unknowns: How many numbers the fit has to find.
        sigma_stated: Whether somebody stated the standard deviation.

    Example:
        >>> from robolink.procedures import may_end_early
        >>> may_end_early(8, unknowns=4, sigma_stated=False)  # four touches of X and Y
        False
        >>> may_end_early(8, unknowns=4, sigma_stated=True)
        True
    """
    return count - 1 - unknowns >= (1 if sigma_stated else LEAST_DOF_TO_STOP)


def _enough(fit: CalibrationResult, until_mm: float | None) -> bool:
    within_mm, dof = fit.repeatable_to_mm, fit.dof or 0
    if until_mm is None or within_mm is None:
        return False
    return (fit.sigma_stated or dof >= LEAST_DOF_TO_STOP) and within_mm <= until_mm


def _progress(
    method: SequentialSampler[PlaceT, TakenT, ResultT],
    fit: CalibrationResult,
    taken: Sequence[TakenT],
    following: TakenT | None,
) -> Notify:
    """Return the result so far."""
    told = agreement(method, fit, last=len(taken) - 1)
    shown = fit_subject(method, fit, taken)
    within_mm = fit.repeatable_to_mm
    if following is None or within_mm is None:
        return Notify(told, fit=shown)
    better = method.gain([*taken, following]) / method.gain(taken)
    next_mm = max(within_mm * better, LEAST_HALF_WIDTH)
    gain = tr(
        "One more at {where} would make it about +-{next} mm.",
        where=method.named(following),
        next=stated_mm(next_mm),
    )
    told = joined(" ", (told, gain))
    return Notify(told, fit=replace(shown, next_mm=next_mm))
