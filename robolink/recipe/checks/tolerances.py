"""Whether drifts and refusals that a recipe speaks of can occur."""

from collections.abc import Iterator

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.recipe.checks.draft import Draft


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
