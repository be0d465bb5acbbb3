"""The two statements of a result in words: what it is repeatable to, and accurate to.

Every face says them in these sentences. The word for what scatter and grid tell alone is
"repeatable"; "accurate" is said only where every row of the budget is counted
(docs/reference/evidence.md 19).

What a turn test says about both statements of a measurement, in sentences.

A drift beyond what the measurement lets expect has a few usual causes, which depend on what was
measured with: a touch, beams, a camera. The rows of the budget tell that
(docs/reference/evidence.md 20).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.calibration.core.accuracy import ACCURACY_ROWS, Accuracy, AssessedRow
from robolink.calibration.core.result import CalibrationResult, DriftVerdict, VerifyResult
from robolink.calibration.core.turn_claim import TurnJudgement
from robolink.deprecation import without_sign
from robolink.messages import joined, spoken, tr

if TYPE_CHECKING:
    from robolink.calibration.core.result import CalibrationResult


SCATTER: Final = "scatter"
"""Key of the row that the measurement shows by itself."""

_DIGITS: Final = 3


def stated_mm(half_width: float, digits: int = _DIGITS) -> str:
    """Return a half width as every screen shows it: never 0, because nothing is known that well.

    What is less than half of the last digit is shown as one of it.

    Args:
        half_width: Half of an interval, mm or degrees.
        digits: Decimals.

    Example:
        >>> from robolink.calibration import stated_mm
        >>> stated_mm(0.0236), stated_mm(0.0002), stated_mm(0.0)
        ('0.024', '0.001', '0.001')
    """
    return f"{max(abs(half_width), 10.0**-digits):.{digits}f}"


def measured_axes(result: "CalibrationResult") -> str:
    """Return the names of the measured lengths: ``X, Y``; empty where no length was measured."""
    return ", ".join(name[0].upper() for name in result.measured if name.endswith("_mm"))


@without_sign
def repeatable_sentence(result: "CalibrationResult") -> str:
    """Return what a result is repeatable to, or why that is unknown; empty without a length.

    Args:
        result: What was measured.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import repeatable_sentence, solve_two_pose
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> repeatable_sentence(solve_two_pose(*touches, sigma_mm=0.02))
        'X, Y: repeatable to +-0.035 mm (95 %).'
        >>> repeatable_sentence(solve_two_pose(*touches))
        'Repeatable: not known (two touches cannot check each other).'
    """
    axes, within_mm = measured_axes(result), result.repeatable_to_mm
    if not axes:
        return ""
    if within_mm is not None:
        return tr(
            "{axes}: repeatable to +-{mm} mm (95 %).",
            axes=axes,
            mm=stated_mm(within_mm),
        )
    if result.method == "one-touch":
        return tr("Repeatable: not known (one touch cannot be checked).")
    if result.method == "two-pose":
        return tr("Repeatable: not known (two touches cannot check each other).")
    return tr("Repeatable: not known (nothing is left over that could check it).")


@without_sign
def accurate_sentence(result: "CalibrationResult") -> str:
    """Return what a result is accurate to; empty without a length.

    Args:
        result: What was measured; :func:`~robolink.calibration.assessed` has judged it.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, accurate_sentence, assessed
        >>> from robolink.calibration import solve_two_pose
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
        >>> accurate_sentence(found)
        'X, Y: accurate to +-0.079 mm (95 %).'
    """
    axes = measured_axes(result)
    if not axes:
        return ""
    if result.accuracy is None:
        return tr("Accurate: not known (its possible errors are not on record).")
    return tr(
        "{axes}: accurate to +-{mm} mm (95 %).",
        axes=axes,
        mm=stated_mm(result.accuracy.within_mm),
    )


@without_sign
def largest_row_sentence(accuracy: Accuracy) -> str:
    """Return which row is the largest, its size, and the source of that.

    Args:
        accuracy: What a result is accurate to.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, assessed, largest_row_sentence
        >>> from robolink.calibration import solve_two_pose
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
        >>> largest_row_sentence(found.accuracy)
        'Largest row: judging contact by eye, +-0.05 mm (default, not measured).'
    """
    row = accuracy.largest
    facts = {"row": row_title(row), "basis": basis_in_words(row)}
    if row.half_width is None:
        return tr("Largest row: {row} ({basis}).", **facts)
    return tr("Largest row: {row}, +-{half} ({basis}).", half=half_width_of(row), **facts)


@without_sign
def statement_sentences(result: "CalibrationResult") -> Iterator[str]:
    """Yield both statements and the largest row, a sentence each; nothing without a length.

    Args:
        result: What was measured.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, assessed, solve_two_pose
        >>> from robolink.calibration import statement_sentences
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches), AccuracyFacts())
        >>> for sentence in statement_sentences(found):
        ...     print(sentence)
        Repeatable: not known (two touches cannot check each other).
        X, Y: accurate to +-0.088 mm (95 %).
        Largest row: judging contact by eye, +-0.05 mm (default, not measured).
    """
    for sentence in (repeatable_sentence(result), accurate_sentence(result)):
        if sentence:
            yield sentence
    if measured_axes(result) and result.accuracy is not None:
        yield largest_row_sentence(result.accuracy)


def statement_line(result: "CalibrationResult") -> str:
    """Return both statements in one line, for a screen with little room; empty without one."""
    within_mm, accuracy = result.repeatable_to_mm, result.accuracy
    if not measured_axes(result):
        return ""
    if within_mm is None or accuracy is None:
        return joined(" ", filter(None, (repeatable_sentence(result), accurate_sentence(result))))
    return tr(
        "{axes}: repeatable to +-{r} mm, accurate to +-{u} mm (95 %).",
        axes=measured_axes(result),
        r=stated_mm(within_mm),
        u=stated_mm(accuracy.within_mm),
    )


@dataclass(frozen=True, slots=True)
class RowInWords:
    """One row of a result's accuracy, as a table shows it.

    Attributes:
        title: What it is.
        half_width: Half its width with its unit; empty for the scatter.
        basis: What tells how large it is.
        u_mm: What it brings to the length that is known worst, as a standard uncertainty.
        share_percent: Its share of the variance of that length.
    """

    title: str
    half_width: str
    basis: str
    u_mm: float
    share_percent: float


def rows_in_words(accuracy: Accuracy) -> tuple[RowInWords, ...]:
    """Return the rows of a result's accuracy, the largest first."""
    whole = sum(row.u_mm**2 for row in accuracy.rows)
    return tuple(
        RowInWords(
            row_title(row),
            half_width_of(row),
            basis_in_words(row),
            row.u_mm,
            100 * row.u_mm**2 / whole if whole > 0 else 0.0,
        )
        for row in accuracy.rows
    )


def row_title(row: AssessedRow) -> str:
    """Return the title of a row in the present language; an unknown one as it was recorded."""
    if row.key == SCATTER:
        return tr("how well it repeats")
    known = ACCURACY_ROWS.get(row.key)
    return row.title if known is None else spoken(known.title)


def half_width_of(row: AssessedRow) -> str:
    """Return half the width of a row with its unit, empty for the scatter."""
    if row.half_width is None:
        return ""
    unit = {"deg": tr("degrees"), "percent": "%"}.get(row.unit, row.unit)
    return f"{row.half_width:.3g} {unit}"


def basis_in_words(row: AssessedRow) -> str:
    """Return the source of a row's size, and where it is stated."""
    if row.key == SCATTER and not row.basis:
        return tr("this measurement")
    words = basis_words(row.basis)
    return f"{words}: {row.told}" if row.told else words


def basis_words(basis: str) -> str:
    """Return ``stated``, ``record`` or ``default`` in words."""
    return {
        "stated": tr("stated for this cell"),
        "record": tr("record of the cell"),
        "default": tr("default, not measured"),
    }.get(basis, basis)


@without_sign
def seating_sentence(within_mm: float | None, changes: int | None) -> str:
    """Return how far off the tip may be after the next mounting; not part of the accuracy.

    Args:
        within_mm: In which distance it lies then, in 95 %; ``None`` where the record is too short.
        changes: How many changes tell it.

    Example:
        >>> from robolink.calibration import seating_sentence
        >>> seating_sentence(0.13, 12)
        'Seating: mounted anew, the tip lies within +-0.130 mm of here (95 %, 12 changes).'
        >>> seating_sentence(None, None)
        'Seating: not known (too few nozzle changes on record).'
    """
    if within_mm is None:
        return tr("Seating: not known (too few nozzle changes on record).")
    return tr(
        "Seating: mounted anew, the tip lies within +-{mm} mm of here (95 %, {count} changes).",
        mm=stated_mm(within_mm),
        count=changes,
    )


def turn_test_headline(result: VerifyResult) -> str:
    """Return how a turn test ended, in one sentence with its figure and its limit.

    A test that contradicts what a result says, or that turned too little, is never called passed.
    """
    found = {"drift": result.max_drift_mm, "limit": result.tolerance_mm}
    judgement = result.judgement
    if result.verdict is DriftVerdict.UNDECIDED:
        return tr("Turn test not decided: {drift:.3f} mm off, limit {limit:.3f} mm.", **found)
    if result.codes or result.verdict is DriftVerdict.FAILED:
        return tr("Turn test failed: {drift:.3f} mm off, limit {limit:.3f} mm.", **found)
    if judgement is not None and judgement.fails:
        return tr(
            "Turn test contradicts the measurement: {drift:.3f} mm off at most, limit "
            "{limit:.3f} mm.",
            **found,
        )
    if result.heights_only:
        return tr("Touched again: {drift:.3f} mm off at most, limit {limit:.3f} mm.", **found)
    if judgement is not None and (judgement.code or judgement.tests > 1):
        return tr(
            "Turn test within its limit, with a doubt: {drift:.3f} mm off at most, limit "
            "{limit:.3f} mm.",
            **found,
        )
    if judgement is not None and judgement.small_angle:
        return tr(
            "Tested at a small angle: {drift:.3f} mm off at most, limit {limit:.3f} mm.", **found
        )
    return tr("Turn test passed: {drift:.3f} mm off at most, limit {limit:.3f} mm.", **found)


def turn_test_sentences(
    judgement: TurnJudgement | None, measured: CalibrationResult | None = None
) -> Iterator[str]:
    """Yield what the drifts show about both statements, possible causes, and how to tell them.

    Args:
        judgement: What the drifts were held to; ``None`` where they were held to the limit of the
            process alone, of which nothing is said here.
        measured: The measurement; its rows tell with what it was made. Without it the causes are
            named for all of them.

    Where a shift of the tip shows only from more on than is stated, that is said, too.

    Example:
        >>> from robolink.calibration import DriftLimits, TurnJudgement, turn_test_sentences
        >>> limits = DriftLimits(repeatable_mm=0.016, accurate_mm=0.09, turn_deg=180.0)
        >>> for sentence in turn_test_sentences(TurnJudgement("", (limits,))):
        ...     print(sentence)
        It agrees with the stated accuracy: scatter alone explains 0.016 mm.
        >>> doubtful = TurnJudgement("proof_contradicts_repeatability", (limits,))
        >>> for sentence in turn_test_sentences(doubtful):
        ...     print(sentence)
        Scatter alone explains only 0.016 mm: it does not repeat as stated.
        Possible causes: the nozzle is loose, or the station has moved.
        To find out: check the mount, then measure again.
    """
    if judgement is None:
        return
    if judgement.tests > 1:
        yield tr(
            "The turn test was made {count} times, because the first contradicted the "
            "measurement; all results count together.",
            count=judgement.tests,
        )
    if judgement.apart_mm is not None:
        yield tr(
            "Results at the same angle differ by {mm} mm: more than the stated repeatability.",
            mm=stated_mm(judgement.apart_mm),
        )
    yield from _explained(judgement)
    if judgement.code:
        yield from _causes(None if measured is None else measured.accuracy)
    if judgement.small_angle:
        yield tr(
            "The tool turned by {turn:.0f} degrees; less than 90 does not count as tested.",
            turn=max(one.turn_deg for one in judgement.limits),
        )
    yield from _not_shown(judgement)


def _not_shown(judgement: TurnJudgement) -> Iterator[str]:
    """Yield how far the tip may have shifted unseen, where that is more than is stated.

    No statement is left where the test contradicts it; a wider one covers what was seen.
    """
    stated, in_plane, in_z = (
        judgement.accurate_mm,
        judgement.shows_from_mm,
        judgement.shows_z_from_mm,
    )
    if stated is None or judgement.fails:
        return
    named = {"X, Y, Z": in_plane} if in_plane == in_z else {"X, Y": in_plane, "Z": in_z}
    shifts = [
        f"{stated_mm(mm)} mm ({axes})"
        for axes, mm in named.items()
        if mm is not None and mm > stated
    ]
    if shifts:
        yield tr(
            "The accuracy assumes that the tip did not shift in its mount before the test: less "
            "than {shifts} may not show.",
            shifts=", ".join(shifts),
        )
    if judgement.misses_z:
        yield tr("This test does not measure height: a shift in Z would not show.")


def _explained(judgement: TurnJudgement) -> Iterator[str]:
    """Yield how much of a drift the statements explain."""
    limit = judgement.limits[judgement.worst]
    if judgement.contradicts_accuracy:
        yield tr(
            "The stated errors explain only {mm} mm: the tip is not where it was measured.",
            mm=stated_mm(limit.accurate_mm),
        )
    elif judgement.contradicts_repeatability and judgement.apart_mm is None:
        yield tr(
            "Scatter alone explains only {mm} mm: it does not repeat as stated.",
            mm=stated_mm(limit.repeatable_mm),
        )
    elif not judgement.code and not judgement.small_angle:
        yield tr(
            "It agrees with the stated accuracy: scatter alone explains {mm} mm.",
            mm=stated_mm(limit.repeatable_mm),
        )


@without_sign
def proved_statements(measured: CalibrationResult, result: VerifyResult | None) -> Iterator[str]:
    """Yield what a tip is repeatable and accurate to after its turn test, a sentence each.

    Where a person took a wider statement, it stands in place of the one that was contradicted.

    Args:
        measured: The measurement with its own statements.
        result: The turn test; ``None`` for none.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import AccuracyFacts, Drift, VerifyResult, assessed
        >>> from robolink.calibration import proved_statements, solve_two_pose
        >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
        >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
        >>> widened = VerifyResult((Drift(90, 0.15, 0),), 0.2, accurate_to_mm=0.22)
        >>> for sentence in proved_statements(found, widened):
        ...     print(sentence)
        X, Y: repeatable to +-0.035 mm (95 %).
        X, Y: accurate to +-0.220 mm (95 %), widened after the turn test.
    """
    own_mm, now_mm = measured.accurate_to_mm, None if result is None else result.accurate_to_mm
    if now_mm is None or (own_mm is not None and now_mm <= own_mm):
        yield from statement_sentences(measured)
        return
    yield repeatable_sentence(measured)
    yield tr(
        "{axes}: accurate to +-{mm} mm (95 %), widened after the turn test.",
        axes=measured_axes(measured),
        mm=stated_mm(now_mm),
    )


def _causes(accuracy: Accuracy | None) -> Iterator[str]:
    """Yield possible causes by instrument, and the step that tells them apart."""
    rows = set() if accuracy is None else {row.key for row in accuracy.rows}
    if "tip_image_px" in rows or "camera_turn_deg" in rows:
        yield tr("Possible causes: the camera was turned or moved, or the nozzle is loose.")
        yield tr("To find out: check the mount, then measure the camera again.")
    elif "plate_mm" in rows:
        yield tr("Possible causes: the surface was moved, or the nozzle is loose.")
        yield tr("To find out: check the mount, then touch once more.")
    elif "touch_mm" in rows and "place_mm" not in rows:
        yield tr("Possible causes: the pin was bumped in between, or the nozzle is loose.")
        yield tr("To find out: check mount and pin, then touch once more.")
    elif "touch_mm" in rows:
        yield tr("Possible causes: the pin was moved since it was learnt, or the nozzle is loose.")
        yield tr("To find out: check the mount, then learn the station again.")
    elif "place_mm" in rows:
        yield tr(
            "Possible causes: the sensor was moved since it was learnt, or the nozzle is loose."
        )
        yield tr("To find out: check the mount, then learn the station again.")
    else:
        yield tr("Possible causes: the nozzle is loose, or the station has moved.")
        yield tr("To find out: check the mount, then measure again.")
