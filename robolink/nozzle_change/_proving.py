"""What makes a proof fail, in sentences."""

from collections.abc import Iterator
from contextlib import contextmanager

from robolink.calibration import DriftVerdict, VerifyResult
from robolink.errors import CalibrationError, VerifyError
from robolink.messages import tr
from robolink.model import Controller
from robolink.nozzle_change._acceptance import AcceptanceCriteria
from robolink.nozzle_change._records import refusal_entry
from robolink.procedures import TOUCH_CODES


@contextmanager
def touches_count(
    controller: Controller, tool: int, criteria: AcceptanceCriteria
) -> Iterator[None]:
    """Let touches of a proof that were not made end it as a failed proof.

    Raises:
        VerifyError: In place of a CalibrationError about touches; it is on record.
    """
    try:
        yield
    except CalibrationError as error:
        if error.code not in TOUCH_CODES:
            raise
        controller.outcomes.append(refusal_entry(tool, criteria, error))
        raise VerifyError(
            tr("The new tip was not proved. {cause}", cause=error.what),
            remedy=error.remedy,
            code=error.code,
            controller=controller.identity,
        ) from error


def require_proved(result: VerifyResult, identity: str) -> None:
    """Refuse a proof that did not pass.

    Args:
        result: What it showed.
        identity: Of the controller.

    Raises:
        VerifyError: The tip drifts, may drift, or its touches do not agree in height.
    """
    if result.passed:
        return
    if result.codes:
        raise VerifyError(
            tr(
                "The heights of the touches of the proof differ from that of the measurement: at "
                "least one touch was in the air."
            ),
            remedy=tr("Measure again, each time until the tip is on the pin."),
            code=result.codes[0],
            controller=identity,
        )
    drift_mm, limit_mm = result.max_drift_mm, result.tolerance_mm
    if result.verdict is DriftVerdict.UNDECIDED:
        what = tr(
            "The tip drifts {drift:.3f} mm when the tool turns: too near to {limit:.3f} mm to tell "
            "whether that is inside, and further touches did not decide it.",
            drift=drift_mm,
            limit=limit_mm,
        )
    else:
        what = tr(
            "The tip drifts {drift:.3f} mm when the tool turns; {limit:.3f} mm are allowed.",
            drift=drift_mm,
            limit=limit_mm,
        )
    raise VerifyError(
        what,
        remedy=tr("Check that the nozzle sits firmly and measure again."),
        code=result.verdict.value,
        controller=identity,
    )
