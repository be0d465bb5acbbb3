"""What a turn test says about both statements of a measurement, in sentences.

A drift beyond what the measurement lets expect has a few usual causes, which depend on what was
measured with: a touch, beams, a camera. The rows of the budget tell that
(docs/reference/evidence.md 20).
"""

from collections.abc import Iterator

from robolink.calibration.core.accuracy import Accuracy
from robolink.calibration.core.result import CalibrationResult, DriftVerdict, VerifyResult
from robolink.calibration.core.turn_claim import TurnJudgement
from robolink.calibration.statement.sentences import (
    measured_axes,
    repeatable_sentence,
    stated_mm,
    statement_sentences,
)
from robolink.deprecation import without_sign
from robolink.messages import tr


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
    """Yield what the drifts say about both statements, what may be the cause, and what would tell.

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
        It contradicts nothing that is stated: scatter alone explains 0.016 mm.
        >>> doubtful = TurnJudgement("proof_contradicts_repeatability", (limits,))
        >>> for sentence in turn_test_sentences(doubtful):
        ...     print(sentence)
        Scatter alone explains 0.016 mm, no more: it does not repeat as stated.
        Possible causes: the nozzle is loose, or what it was measured at has moved.
        To find out: check the mount, then measure again.
    """
    if judgement is None:
        return
    if judgement.tests > 1:
        yield tr(
            "The turn test was made {count} times, because the first contradicted the measurement; "
            "all its looks count together.",
            count=judgement.tests,
        )
    if judgement.apart_mm is not None:
        yield tr(
            "At one angle its looks lie {mm} mm apart: it does not repeat as stated.",
            mm=stated_mm(judgement.apart_mm),
        )
    yield from _explained(judgement)
    if judgement.code:
        yield from _causes(None if measured is None else measured.accuracy)
    if judgement.small_angle:
        yield tr(
            "The tool was turned by {turn:.0f} degrees; less than 90 is not called tested.",
            turn=max(one.turn_deg for one in judgement.limits),
        )
    yield from _not_shown(judgement)


def _not_shown(judgement: TurnJudgement) -> Iterator[str]:
    """Yield by how much the tip may have shifted unseen, where that is more than is stated.

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
        yield tr("This test tells no height: a shift in Z would not show.")


def _explained(judgement: TurnJudgement) -> Iterator[str]:
    """Yield how much of a drift the statements explain."""
    limit = judgement.limits[judgement.worst]
    if judgement.contradicts_accuracy:
        yield tr(
            "All that is stated explains {mm} mm, no more: the tip is not where it was measured.",
            mm=stated_mm(limit.accurate_mm),
        )
    elif judgement.contradicts_repeatability and judgement.apart_mm is None:
        yield tr(
            "Scatter alone explains {mm} mm, no more: it does not repeat as stated.",
            mm=stated_mm(limit.repeatable_mm),
        )
    elif not judgement.code and not judgement.small_angle:
        yield tr(
            "It contradicts nothing that is stated: scatter alone explains {mm} mm.",
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
    """Yield what may have happened, by what was measured with, and the step that would tell."""
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
        yield tr("Possible causes: the nozzle is loose, or what it was measured at has moved.")
        yield tr("To find out: check the mount, then measure again.")
