"""The view of how well the touches agree."""

import math

from robolink.calibration import stated_mm
from robolink.messages import tr
from robolink.runner import FitRow, FitSubject
from robolink_cli.wizard.questions_flow import worst_first
from robolink_cli.wizard.views.frame import JobStep, Part, leaves, mm
from robolink_cli.wizard.views.records import Action, FitMark, FitView, Weight


def fit_part(fit: FitSubject) -> Part:
    """Return the view of a fit whose worst sample may be repeated."""
    worst = fit.rows[fit.worst].number if fit.worst is not None else 0
    first = worst_first(fit)
    retake = Action(
        "again",
        tr("Touch {k} again", k=worst),
        key="/",
        weight=Weight.MAIN if first else Weight.PLAIN,
    )
    show = Action(
        "go_on",
        tr("Show the result"),
        key="5",
        weight=Weight.PLAIN if first else Weight.MAIN,
    )
    more = (Action("more", tr("One more touch"), key="+"),) if fit.more else ()
    # The recommended action comes first; the keys do not change.
    actions = (retake, *more, show) if first else (show, *more, retake)
    return Part(tr("How well it fits"), fit_view(fit), (*actions, leaves(tr("STOP"))), JobStep.FIT)


def fit_view(fit: FitSubject) -> FitView:
    """Return the marks, and their meaning in words."""
    marks = tuple(
        FitMark(
            row.number,
            row.where,
            row.off_mm,
            math.hypot(*row.off_mm),
            _side(row),
            index == fit.worst,
        )
        for index, row in enumerate(fit.rows)
    )
    told = []
    if fit.rms_mm is not None:
        told.append(tr("The {n} touches agree within {r} mm.", n=len(marks), r=mm(fit.rms_mm)))
    if fit.repeatable_mm is not None:
        told.append(tr("Repeatable to +-{h} mm (95 %).", h=stated_mm(fit.repeatable_mm)))
    if fit.next_mm is not None:
        told.append(tr("One more touch would make it about +-{h} mm.", h=stated_mm(fit.next_mm)))
    if worst_first(fit) and fit.worst is not None:
        told.append(
            tr(
                "Touch {k} is {d} mm off, much more than the others.",
                k=fit.rows[fit.worst].number,
                d=mm(marks[fit.worst].away_mm),
            )
        )
    return FitView(marks, fit.limit_mm, tuple(told), fit.rms_mm, fit.repeatable_mm)


def _side(row: FitRow) -> str:
    """Return the base axis and side on which a touch is off most: ``Y-``.

    A single component is a height. The keys of a jog bear the same names.
    """
    axes = "Z" if len(row.off_mm) == 1 else "XYZ"
    axis, off = max(zip(axes, row.off_mm, strict=False), key=lambda one: abs(one[1]))
    return f"{axis}{'+' if off > 0 else '-'}"
