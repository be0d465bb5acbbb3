"""Whether what is to be judged in a recipe can be known at all."""

from collections.abc import Iterator
from statistics import NormalDist

from robolink.calibration import planar_sigma_gain
from robolink.config import Problem
from robolink.messages import tr
from robolink.model import Pose
from robolink.recipe._draft import Draft
from robolink.recipe._sources import (
    AnySource,
    BeamsSource,
    BoardSource,
    CameraSource,
    OneTouchSource,
    OperatorSource,
    TouchSource,
)


def residuals(draft: Draft) -> Iterator[Problem]:
    """Check that residuals are judged only where there are some."""
    limits = draft.tolerances
    if limits is None:
        return
    if draft.source is not None and draft.source.agrees_always:
        for key in ("rms_mm", "max_mm"):
            if getattr(limits, key) is not None:
                yield Problem(f"tolerances.{key}", _without_residual(draft.source))
    if limits.rms_mm is not None and limits.max_mm is not None and limits.max_mm < limits.rms_mm:
        yield Problem(
            "tolerances.max_mm", tr("must be at least rms_mm: no rms exceeds the largest")
        )


def intervals(draft: Draft) -> Iterator[Problem]:
    """Check that the interval can be known, and can be as narrow as it has to be."""
    limits, source = draft.tolerances, draft.source
    if limits is None or source is None or limits.interval_mm is None:
        return
    if limits.sigma_mm is None:
        # One touch may take it from the calibration before.
        if source.agrees_always and not isinstance(source, OneTouchSource):
            yield Problem(
                "tolerances.sigma_mm",
                tr(
                    "is missing: the measurement leaves no residual, so interval_mm can be judged "
                    "only from a stated standard deviation"
                ),
            )
    elif isinstance(source, OperatorSource) and source.touches_deg:
        touches = [Pose(0.0, 0.0, 0.0, u_deg) for u_deg in source.touches_deg]
        half_mm = NormalDist().inv_cdf(0.975) * limits.sigma_mm * planar_sigma_gain(touches)
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
    if draft.verify is False or not source.moves:
        yield Problem("tolerances.drift_mm", tr("means nothing: no drift is measured"))


def refusals(draft: Draft) -> Iterator[Problem]:
    """Check that attempts are allowed where it is measured again."""
    refusal = draft.refusal
    if refusal is not None and refusal.action == "stop" and refusal.attempts is not None:
        yield Problem("refusal.attempts", tr('means nothing without action = "measure_again"'))


def _without_residual(source: AnySource) -> str:
    if isinstance(source, BeamsSource):
        return tr(
            "cannot be judged: crossings that are not repeated always agree, so they leave no "
            "residual; use repeats = 2, or interval_mm with sigma_mm"
        )
    if isinstance(source, TouchSource):
        return tr(
            "cannot be judged: two touches always agree, so they leave no residual; give four "
            "speeds_mm_s, or interval_mm with sigma_mm"
        )
    if isinstance(source, CameraSource):
        return tr(
            "cannot be judged: looks at one or two angles always agree, so they leave no residual; "
            "give three turns_deg or more, or interval_mm with sigma_mm"
        )
    if isinstance(source, BoardSource):
        return tr(
            "cannot be judged: two fiducials at one angle always agree, so they leave no residual; "
            "give two turns_deg or more, or interval_mm with sigma_mm"
        )
    if isinstance(source, OneTouchSource):
        return tr("cannot be judged: one touch leaves no residual; use interval_mm")
    return tr(
        "cannot be judged: two poses always agree, so they leave no residual; "
        'use method = "n_angle", or interval_mm with sigma_mm'
    )
