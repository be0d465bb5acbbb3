"""Screen (e): how well the touches fit, with bars."""

import math
from typing import Final

from robolink.calibration import stated_mm
from robolink.messages import tr
from robolink.runner import FitRow, FitSubject
from robolink_cli.console.columns import padded
from robolink_cli.wizard.questions_flow import worst_first
from robolink_cli.wizard.screens.layout import Screen
from robolink_cli.wizard.screens.rows import JobStep, mm, title_row
from robolink_cli.wizard.state import WizardState

_BAR: Final = 20
_MOST_ROWS: Final = 9


def fit_screen(state: WizardState, fit: FitSubject) -> Screen:
    """Return the screen of a fit whose worst sample may be taken again."""
    again = worst_first(fit)
    worst = fit.rows[fit.worst].number if fit.worst is not None else 0
    retake, show = tr("Touch {k} again", k=worst), tr("Show the result")
    more = (("1", tr("One more touch")),) if fit.more else ()
    if again:
        keys = (("5", retake), *more, ("3", show))
    else:
        keys = (("5", show), *more, ("/" if more else "1", retake))
    return Screen(
        title_row(state, tr("How well it fits"), JobStep.FIT),
        ("", *fit_lines(fit)),
        (*keys, ("0", tr("STOP"))),
        message=state.message,
    )


def fit_lines(fit: FitSubject) -> list[str]:
    """Return the bars, and what they say in words."""
    away = [math.hypot(*row.off_mm) for row in fit.rows]
    limit = fit.limit_mm
    scale = max([limit, *away]) or 1.0
    head = padded(" " + tr("Touch"), 25) + tr("off by")
    lines = [padded(head, 48) + tr("limit {mm} mm", mm=f"{limit:g}")]
    ranked = sorted(range(len(away)), key=lambda i: -away[i])[:_MOST_ROWS]
    for index, (row, far) in enumerate(zip(fit.rows, away, strict=True)):
        if index in ranked:
            mark = tr("fits worst") if index == fit.worst else ""
            lines.append(
                f" {padded(row.where, 24)}{mm(far)}  {padded(_side(row), 14)}"
                f"{_bar(far, limit, scale)} {mark}"
            )
    lines.append("")
    if fit.rms_mm is not None:
        lines.append(tr("The {n} touches agree within {r} mm.", n=len(away), r=mm(fit.rms_mm)))
    if fit.repeatable_mm is not None:
        lines.append(tr("Repeatable to +-{h} mm (95 %).", h=stated_mm(fit.repeatable_mm)))
    if fit.next_mm is not None:
        lines.append(tr("One more touch would make it about +-{h} mm.", h=stated_mm(fit.next_mm)))
    if worst_first(fit) and fit.worst is not None:
        lines.append(
            tr(
                "Touch {k} is {d} mm off, much more than the others.",
                k=fit.rows[fit.worst].number,
                d=mm(away[fit.worst]),
            )
        )
    return lines


def _side(row: FitRow) -> str:
    """Return to which side a touch is off, seen from above with X to the right."""
    x, y = row.off_mm[0], row.off_mm[1] if len(row.off_mm) > 1 else 0.0
    if abs(x) >= abs(y):
        return tr("to the right") if x > 0 else tr("to the left")
    return tr("up") if y > 0 else tr("down")


def _bar(far: float, limit: float, scale: float) -> str:
    filled = round(_BAR * far / scale)
    at = round(_BAR * limit / scale)
    bar = "#" * filled + " " * (_BAR - filled)
    return bar if at >= _BAR else f"{bar[:at]}|{bar[at + 1 :]}"
