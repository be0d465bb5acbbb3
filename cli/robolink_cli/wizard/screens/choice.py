"""Screens (a) and (j): a list from which a person chooses."""

from typing import Final

from robolink.messages import tr
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import BODY, Screen, broken, keys_of, status_row, title_row
from robolink_cli.wizard.views.records import CheckRow, CheckView, ChoiceView, View

_LEAST_SHOWN: Final = 3
"""Fewest options on the screen, however long the text above them."""


def choice_screen(view: View, body: ChoiceView) -> Screen:
    """Return the screen of a list; if it is too long, the part around the mark."""
    above = [row for line in body.above for row in broken(line)]
    most = BODY - 2 - min(_LEAST_SHOWN, len(body.rows))
    if len(above) > most:
        # The options must be visible.
        above = [*above[: most - 1], "..."]
    details = () if body.marked is None else body.rows[body.marked].details
    told = [row for line in details for row in broken(line)]
    room = max(_LEAST_SHOWN, BODY - len(above) - 2 - (len(told) + 1 if told else 0))
    first = max(0, min((body.marked or 0) - room // 2, len(body.rows) - room))
    rows = []
    for index, option in enumerate(body.rows[first : first + room], start=first):
        sign = ">" if index == body.marked else " "
        rows.append(f"{sign} {option.text}")
    return Screen(
        title_row(view.head),
        (*above, "", body.question, *rows, *(["", *told] if told else ())),
        (("5", body.does), (tr("arrows"), tr("choose")), *keys_of(view)),
        status=status_row(view.status) if view.status is not None else "",
        message=view.message,
    )


def check_screen(view: View, body: CheckView) -> Screen:
    """Return the screen of the check list."""
    rows, marked = [row for row in body.rows if row.name], body.marked
    start, *leave = view.actions
    here = rows[marked] if marked is not None and marked < len(rows) else None
    listed = [line for row in body.rows for line in point_rows(row, marked=row is here)]
    listed.append(f"{'>' if marked == len(rows) else ' '}{' ' * 7}{start.label}")
    main = () if marked is None else (("5", start.label if here is None else here.does),)
    return Screen(
        title_row(view.head),
        (*listed, "", *broken(body.plan), tr("Keep a hand near the emergency stop.")),
        (*main, (tr("arrows"), tr("choose")), *((one.key, one.label) for one in leave)),
        status=status_row(view.status),
        message=view.message,
    )


def point_rows(row: CheckRow, *, marked: bool) -> list[str]:
    """Return a point, broken to two rows where it is long."""
    first, *rest = broken(row.text, 71)
    line = f"{'>' if marked else ' '}{padded(row.word, 7)}{first}"
    return [line, *(f"         {more}" for more in rest)]
