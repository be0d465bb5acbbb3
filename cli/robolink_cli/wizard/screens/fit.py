"""Screen (e): how well the touches fit, with bars."""

from collections.abc import Iterator
from typing import Final

from robolink.messages import tr
from robolink_cli.console.tables import columns, padded
from robolink_cli.wizard.screens.layout import WIDTH, Screen, keys_of, title_row
from robolink_cli.wizard.views.frame import mm
from robolink_cli.wizard.views.records import FitView, View

_BAR: Final = 20
_LEAST_BAR: Final = 8
"""Shortest useful bar, in columns."""

_MOST_ROWS: Final = 9


def fit_screen(view: View, body: FitView) -> Screen:
    """Return the screen of a fit whose worst sample may be repeated."""
    return Screen(title_row(view.head), ("", *fit_lines(body)), keys_of(view), message=view.message)


def fit_lines(fit: FitView, width: int = WIDTH) -> list[str]:
    """Return the bars, and their meaning in words.

    Args:
        fit: The fit.
        width: How many columns there are.
    """
    return [*_table(fit, width), "", *fit.told]


def _table(fit: FitView, width: int) -> Iterator[str]:
    """Yield a row for each of the worst touches, its bar as long as there is room.

    Where not even its name has room beside its figures, these stand in a row below.
    """
    marks = fit.marks
    ranked = sorted(range(len(marks)), key=lambda i: -marks[i].away_mm)[:_MOST_ROWS]
    shown = [
        (one.where, mm(one.away_mm), one.side, tr("fits worst") if one.worst else "", one.away_mm)
        for index, one in enumerate(marks)
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
    scale = max([fit.limit_mm, *(one.away_mm for one in marks)]) or 1.0
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


def _bar(far: float, limit: float, scale: float, length: int) -> str:
    filled = round(length * far / scale)
    at = round(length * limit / scale)
    bar = "#" * filled + " " * (length - filled)
    return bar if at >= length else f"{bar[:at]}|{bar[at + 1 :]}"
