"""Whether what is to be judged in a recipe can be known at all."""

from collections.abc import Iterator

from robolink.calibration import NORMAL_95
from robolink.config import Problem
from robolink.messages import tr
from robolink.recipe.checks.draft import Draft


def residuals(draft: Draft) -> Iterator[Problem]:
    """Check that residuals are judged only where there are some."""
    limits = draft.tolerances
    if limits is None:
        return
    why = draft.source.parameters.no_residual() if draft.source is not None else ""
    for key in ("rms_mm", "max_mm"):
        if why and getattr(limits, key) is not None:
            yield Problem(f"tolerances.{key}", why)
    if limits.rms_mm is not None and limits.max_mm is not None and limits.max_mm < limits.rms_mm:
        yield Problem(
            "tolerances.max_mm", tr("must be at least rms_mm: no rms exceeds the largest")
        )


def intervals(draft: Draft) -> Iterator[Problem]:
    """Check that the interval can be known, and can be as narrow as it has to be."""
    limits, source = draft.tolerances, draft.source
    if limits is None or source is None or limits.interval_mm is None:
        return
    parameters = source.parameters
    if limits.sigma_mm is None:
        # One touch may take it from the calibration before.
        if parameters.no_residual() and source.of_method.by_reference:
            yield Problem(
                "tolerances.sigma_mm",
                tr(
                    "is missing: the measurement leaves no residual, so interval_mm can be judged "
                    "only from a stated standard deviation"
                ),
            )
    elif gain := parameters.sigma_gain():
        half_mm = NORMAL_95 * limits.sigma_mm * gain
        if half_mm > limits.interval_mm:
            yield Problem(
                "tolerances.interval_mm",
                tr(
                    "can never be met: with sigma_mm = {sigma:g} and these angles it is {half:.3f}",
                    sigma=limits.sigma_mm,
                    half=half_mm,
                ),
            )


def verification(draft: Draft) -> Iterator[Problem]:
    """Check that a drift is judged only where one is measured."""
    limits, source = draft.tolerances, draft.source
    if limits is None or source is None or "drift_mm" not in limits.model_fields_set:
        return
    if draft.verify is False or not source.of_method.needs.motion:
        yield Problem("tolerances.drift_mm", tr("means nothing: no drift is measured"))


def refusals(draft: Draft) -> Iterator[Problem]:
    """Check that attempts are allowed where it is measured again."""
    refusal = draft.refusal
    if refusal is not None and refusal.action == "stop" and refusal.attempts is not None:
        yield Problem("refusal.attempts", tr('means nothing without action = "measure_again"'))
