"""Doubts about a measurement: the limits, and the named doubts and notes as sentences.

Residuals above the limits give a result a warning (docs/reference/calibration.md 3); others tell
how a touch was made (docs/reference/evidence.md 1). A code is for programs; what a person reads, on
a screen or in a report, is the same sentence.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration.core.result import RunOrder
from robolink.deprecation import deprecated
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word

BEYOND_TOLERANCE: Final = ("large_residual", "large_rms", "large_pixel_residual")
"""Codes of a result that contradicts itself, the plainest first; such a result must not be written.
"""


def beyond_tolerance(codes: Sequence[str], *, judged: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the codes for which an unattended result is refused, the plainest first.

    Args:
        codes: Those of the result.
        judged: Codes for which somebody stated a limit, which then decides.
    """
    return tuple(code for code in BEYOND_TOLERANCE if code in codes and code not in judged)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Residual limits of a good calibration, mm.

    Attributes:
        rms_mm: For the root mean square of the residual distances.
        max_residual_mm: For the largest of them.
    """

    rms_mm: float
    max_residual_mm: float

    def exceeded(self, rms_mm: float | None, max_residual_mm: float | None) -> tuple[str, ...]:
        """Return the codes of the limits that are exceeded."""
        found = []
        if rms_mm is not None and rms_mm > self.rms_mm:
            found.append("large_rms")
        if max_residual_mm is not None and max_residual_mm > self.max_residual_mm:
            found.append("large_residual")
        return tuple(found)

    @deprecated("Tolerance.exceeded")
    def doubts(self, rms_mm: float | None, max_residual_mm: float | None) -> tuple[str, ...]:
        """Return what :meth:`exceeded` returns."""
        return self.exceeded(rms_mm, max_residual_mm)


PLANAR_TOLERANCE = Tolerance(rms_mm=0.05, max_residual_mm=0.15)
"""Tolerance for a camera or a clearly visible pin on four axes."""

TOUCH_TOLERANCE = Tolerance(rms_mm=0.3, max_residual_mm=1.0)
"""Tolerance for a pin touched with six axes."""


NEAREST_MM: Final = 0.8
FARTHEST_MM: Final = 1.2
"""Range of distances beside the pin at which the tip stops, mm: well above a person's aiming error.
"""

LEVELS_MM: Final = (0.0, 0.6, 1.2, 1.8)
"""Heights above the clearance at which the tip stops, mm: they differ, so that jogging down by the
same amount each time would not end at one height."""

HIGHEST_MM: Final = max(LEVELS_MM)

LEAST_JOG_MM: Final = 0.02
PRINT_STEPS: Final = 3
"""Largest difference between positions that a robot at rest prints, in last digits."""

LEAST_HEIGHT_LIMIT_MM: Final = 0.10
PERSON_SIGMA_Z_MM: Final = 0.05
PROBE_SIGMA_Z_MM: Final = 0.01
"""Standard deviation of a touch in height, in mm, by a person and by a contact input."""

MOST_LEFT: Final = 0.5
"""Largest share of the standoffs that may be left, including the uncertainty of the share."""

MOST_RESIDUAL_MM: Final = 0.15


def doubt_sentence(code: str) -> str:
    """Return the sentence for the code of a doubt or a note; an unknown code in words.

    Args:
        code: As it stands in ``CalibrationResult.warnings`` or ``notes``.
    """
    known = _SENTENCES.get(code)
    return code.replace("_", " ") if known is None else known()


def known_doubts(codes: Iterable[str]) -> tuple[str, ...]:
    """Return the sentences of the codes that have one, each once, in their order.

    Codes that a caller tells in other words have none.
    """
    known = (_SENTENCES.get(code) for code in dict.fromkeys(codes))
    return tuple(sentence() for sentence in known if sentence is not None)


def order_in_words(order: RunOrder) -> str:
    """Return between which touches something moved, and how far; empty if nothing did."""
    if order.finding == "step_in_run_order":
        return tr(
            "Between touch {before} and {after} something moved by {shift:.2f} mm.",
            before=order.step_after,
            after=order.step_after + 1,
            shift=math.hypot(*order.step_mm),
        )
    if order.finding == "drift_in_run_order":
        return tr(
            "From the first touch to the last something drifted by {shift:.2f} mm.",
            shift=math.hypot(*order.drift_mm),
        )
    return ""


# Functions, because the language is chosen only when a command runs.
_SENTENCES: Final[Mapping[str, Callable[[], str]]] = {
    "small_rotation": lambda: tr("The poses differ little in U; half a turn would be best."),
    "few_poses": lambda: tr("Too few poses to find the wrong one; four or more would show it."),
    "large_rms": lambda: tr("The measurements agree badly with each other for this method."),
    "large_residual": lambda: tr("One touch is far off. Touch it again."),
    "camera_moved": lambda: tr(
        "The camera is off: it was moved, or its calibration is out of date."
    ),
    "focus_not_taught": lambda: tr(
        "The tip's edge is wide in the pictures and nobody taught the camera's focus: learn the "
        "station."
    ),
    "unequal_scale": lambda: tr("The camera's two axes differ greatly in scale."),
    "large_shear": lambda: tr("The image is askew: the camera seems to lean."),
    "large_pixel_residual": lambda: tr(
        "The looks differ from each other by more than half a pixel."
    ),
    "turned_from_stored": lambda: tr(
        "An axis is more than 45 degrees from the stored one: make sure that +X and +Z "
        "were not confused with other axes. The tilt test cannot show that."
    ),
    "ways_askew": lambda: tr(
        "The two moves are further from a right angle than the touches explain: the "
        "orientation is less accurate than its +- says."
    ),
    "full_calibration_due": lambda: tr(
        "A full calibration is due: the errors of the needle changes since the last "
        "one have added up."
    ),
    "duplicate_poses": lambda: tr(
        "Some poses are copies of others; a copy adds nothing and counts once."
    ),
    "sigma_contradicted": lambda: tr(
        "The poses agree less well than stated; the +- comes from how well they agree."
    ),
    "residuals_too_small": lambda: tr(
        "The poses agree far better than stated: they may be copied or smoothed, or the "
        "stated value is too large."
    ),
    "high_leverage": lambda: tr(
        "The result depends on a single pose; take one more near it, so that an error would show."
    ),
    "step_in_run_order": lambda: tr(
        "Between two touches something moved: those before and those after do not agree. Take "
        "them all again."
    ),
    "drift_in_run_order": lambda: tr(
        "The touches drift from the first to the last: something warms up or gives way. Take them "
        "all again."
    ),
    "approach_bias": lambda: tr(
        "The touches are off toward the side that the tip came from. Approach from several sides."
    ),
    "wobble": lambda: tr("The tip wobbles when it turns: it is bent, or the camera leans."),
    "wobble_not_identifiable": lambda: tr(
        "These angles cannot separate an offset from a wobble; four or more over a full turn could."
    ),
    "overshoot": lambda: tr(
        "The tip overshoots after the trigger; the result is corrected for it."
    ),
    "station_undecided": lambda: tr(
        "These tools cannot show whether the station moved; a relevant shift could stay unseen."
    ),
    "drift_undecided": lambda: tr(
        "The turn test is too near its limit to pass or fail; make more touches."
    ),
    "not_judged": lambda: tr(
        "A limit is set, but it cannot be judged: the size of the errors is not known."
    ),
    "gauge_marginal": lambda: tr(
        "The measurement repeats only just well enough for the tolerance."
    ),
    "gauge_unfit": lambda: tr("The measurement does not repeat well enough for the tolerance."),
    "chart_point_out": lambda: tr("A value is outside the limits of the chart."),
    "chart_drift": lambda: tr("The chart shows a slow drift."),
    "resolution_floor": lambda: tr(
        "The poses agree better than the robot's position display; the +- comes from the "
        "smallest step it shows."
    ),
    "needle_leans": lambda: tr(
        "The needle leans. X and Y are those of its end, corrected by how its shaft leans."
    ),
    "height_not_assessed": lambda: tr(
        "The flange leans, so an error of the tool's Z reaches X and Y. How accurate Z is "
        "was not given, so the +- leaves it out."
    ),
    "order_not_testable": lambda: tr(
        "Drift during the measurement cannot be checked with fewer than six touches."
    ),
    "touches_not_witnessed": lambda: tr(
        "These touches were not seen by robolink: the poses were taught, typed or read from a file."
    ),
    "proof_contradicts_repeatability": lambda: tr(
        "The turn test differs from the measurement by more than its repeatability: was "
        "the station moved, is the nozzle loose, was a touch off?"
    ),
    "proof_contradicts_accuracy": lambda: tr(
        "The turn test contradicts what the measurement is accurate to: was the station moved, is "
        "the nozzle loose, was the camera turned?"
    ),
    "turn_test_repeated": lambda: tr(
        "The turn test was repeated after it contradicted the measurement; all its results "
        "count together."
    ),
    "tested_at_small_angle": lambda: tr(
        "The turn test turned the tool by less than 90 degrees from where it was measured, so it "
        "shows little."
    ),
    "axes_not_confirmed": lambda: tr(
        "Nobody confirmed that all axes were held by their motors (not SFREE) when these poses "
        "were taught. To confirm it: {option}.",
        option=remedy_word(RemedyWord.AXES_HELD),
    ),
    "length_changed": lambda: tr("The length of the tool has changed."),
    "length_not_observable": lambda: tr(
        "These touches cannot show whether the length of the tool has changed."
    ),
}
"""Sentence for each doubt, by code; doubts that callers describe themselves are not included."""
