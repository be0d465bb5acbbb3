"""Screen (e): how well the touches fit, with bars."""

import math
from collections.abc import Iterator
from typing import Final

from robolink.calibration import stated_mm
from robolink.messages import tr
from robolink.runner import FitRow, FitSubject
from robolink_cli.console.tables import columns, padded
from robolink_cli.wizard.questions_flow import worst_first
from robolink_cli.wizard.screens.layout import WIDTH, JobStep, Screen, mm, title_row
from robolink_cli.wizard.state import WizardState

_BAR: Final = 20
_LEAST_BAR: Final = 8
"""Shortest useful bar, in columns."""

_MOST_ROWS: Final = 9


def fit_screen(state: WizardState, fit: FitSubject) -> Screen:
    """Return the screen of a fit whose worst sample may be repeated."""
    worst = fit.rows[fit.worst].number if fit.worst is not None else 0
    retake, show = ("/", tr("Touch {k} again", k=worst)), ("5", tr("Show the result"))
    more = (("+", tr("One more touch")),) if fit.more else ()
    # The recommended action comes first; the keys do not change.
    keys = (retake, *more, show) if worst_first(fit) else (show, *more, retake)
    return Screen(
        title_row(state, tr("How well it fits"), JobStep.FIT),
        ("", *fit_lines(fit)),
        (*keys, ("0", tr("STOP"))),
        message=state.message,
    )


def fit_lines(fit: FitSubject, width: int = WIDTH) -> list[str]:
    """Return the bars, and their meaning in words.

    Args:
        fit: The fit.
        width: How many columns there are.
    """
    away = [math.hypot(*row.off_mm) for row in fit.rows]
    lines = [*_table(fit, away, width), ""]
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


def _table(fit: FitSubject, away: list[float], width: int) -> Iterator[str]:
    """Yield a row for each of the worst touches, its bar as long as there is room.

    Where not even its name has room beside its figures, these stand in a row below.
    """
    ranked = sorted(range(len(away)), key=lambda i: -away[i])[:_MOST_ROWS]
    shown = [
        (row.where, mm(far), _side(row), tr("fits worst") if index == fit.worst else "", far)
        for index, (row, far) in enumerate(zip(fit.rows, away, strict=True))
        if index in ranked
    ]
    limit = tr("limit {mm} mm", mm=f"{fit.limit_mm:g}")
    touch, off_by = tr("Touch"), tr("off by")
    name = max(columns(touch), *(columns(where) for where, *_ in shown)) + 2
    figures = max(columns(off_by), *(len(far) + 2 + len(side) for _, far, side, *_ in shown)) + 2
    mark = max(columns(worst) for _, _, _, worst, _ in shown)
    below = 1 + name + figures + mark > width
    first = 3 if below else 1 + name
    room = width - first - figures - (mark + 1 if mark else 0)
    bar = min(_BAR, room) if room >= _LEAST_BAR else 0
    scale = max([fit.limit_mm, *away]) or 1.0
    head = (padded(f" {touch}", first) if not below else "   ") + padded(off_by, figures)
    if columns(head + limit) <= width:
        head += limit
    if below:
        yield f" {touch}"
    yield head.rstrip()
    for where, far_mm, side, worst, far in shown:
        row = padded(f"{far_mm}  {side}", figures)
        if bar:
            row += padded(_bar(far, fit.limit_mm, scale, bar), bar + 1)
        if below:
            yield f" {where}"
            yield f"   {row}{worst}".rstrip()
        else:
            yield f"{padded(f' {where}', first)}{row}{worst}".rstrip()


def _side(row: FitRow) -> str:
    """Return the base axis and side on which a touch is off most: ``Y-``.

    A single component is a height. The keys of a jog bear the same names.
    """
    axes = "Z" if len(row.off_mm) == 1 else "XYZ"
    axis, off = max(zip(axes, row.off_mm, strict=False), key=lambda one: abs(one[1]))
    return f"{axis}{'+' if off > 0 else '-'}"


def _bar(far: float, limit: float, scale: float, length: int) -> str:
    filled = round(length * far / scale)
    at = round(length * limit / scale)
    bar = "#" * filled + " " * (length - filled)
    return bar if at >= length else f"{bar[:at]}|{bar[at + 1 :]}"
