"""Screens (d) and (g): jog the tip onto the pin."""

from robolink.messages import tr
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import (
    Screen,
    TerminalDraft,
    keys_of,
    row_of,
    status_row,
    title_row,
)
from robolink_cli.wizard.views.frame import UPRIGHT, mm
from robolink_cli.wizard.views.records import JogPad, TouchView, View

_HEAD = 14

_MOST_ANGLES = 4
"""Most angles of the turn test above the keys. More would leave no room for a message."""


def touch_screen(view: View, body: TouchView, draft: TerminalDraft) -> Screen:
    """Return the screen on which a person jogs the tip to a place."""
    lines = [
        *body.instruction,
        *_angles(body, _MOST_ANGLES - _is_tilted(body)),
        "",
        *_where(body),
        *_since(body),
        *_contact(body),
    ]
    lines += [*_range(body), "", *_keypad(body.pad), *_typing(view, body, draft)]
    return Screen(
        title_row(view.head),
        tuple(lines),
        _keys(view, body),
        status=status_row(view.status),
        message=view.message,
    )


def _angles(body: TouchView, most: int) -> list[str]:
    """Return the turn test's angles so far, the newest, and the next one."""
    if not body.angles:
        return []
    rows = [row_of((tr("U"), tr("off by")))]
    for one in body.angles[-most:]:
        off = f"{mm(one.off_mm)} mm"
        rows.append(row_of((f"{one.u_deg:.1f}", off), 11) + f"     {one.word}")
    if body.next_u_deg is not None:
        now = row_of((f"{body.next_u_deg:.1f}", ""), 11)
        rows.append(now + "     " + tr("jog now"))
    return rows


def _where(body: TouchView) -> list[str]:
    if not body.rows:
        return [body.where]
    head = padded("", _HEAD) + row_of([row.name for row in body.rows])
    return [head, padded(f" {body.where}", _HEAD) + row_of([row.now for row in body.rows])]


def _since(body: TouchView) -> list[str]:
    if not body.way:
        return []
    name = tr("Since start") if body.free else tr("Since arrival")
    lines = [padded(f" {name}", _HEAD) + row_of([row.since for row in body.rows])]
    if _is_tilted(body):
        lines.append(padded("", _HEAD) + f"   {body.way}")
    else:
        lines[0] += f"   {body.way}"
    if body.height:
        lines.append(" " + tr("Height against touch 1") + f"   {body.height}")
    return lines


def _is_tilted(body: TouchView) -> bool:
    """Return whether six columns are shown: they fill a row, with nothing beside them."""
    return len(body.rows) > len(UPRIGHT)


def _contact(body: TouchView) -> list[str]:
    return [padded(" " + tr("Contact"), _HEAD) + f"   {body.contact}"] if body.contact else []


def _range(body: TouchView) -> list[str]:
    """Return the limits of a free jog, in the columns of its position."""
    rows = ((tr("Lowest"), body.lowest), (tr("Highest"), body.highest))
    return [padded(f" {name}", _HEAD) + row_of(ends) for name, ends in rows if ends]


def _keypad(pad: JogPad) -> list[str]:
    at = {arrow.place: arrow.label for arrow in pad.arrows}
    sizes = " ".join(f"({size:.2f})" if size == pad.size else f" {size:.2f} " for size in pad.sizes)
    step = tr("Step   {mm} mm", mm=f"{pad.size:.2f}")
    above, below, turns = tr("Z+ up"), tr("Z- down"), tr("Turn keys")
    return [
        padded(f"     [8] {at['up']}         [9] {above}", 40) + f"{step}    [+] [-]",
        padded(f" [4] {at['left']}   [6] {at['right']}", 40) + sizes,
        padded(f"     [2] {at['down']}         [3] {below}", 40)
        + f"[1] U-   [7] U+   [Tab] {turns}",
    ]


def _typing(view: View, body: TouchView, draft: TerminalDraft) -> list[str]:
    """Return the field of a typed pose, if one can be typed."""
    if draft.typing:
        return [
            "",
            tr(
                "Pose {names}: {typed}_  Enter closes the field.",
                names=" ".join(row.name for row in body.rows) or " ".join(UPRIGHT),
                typed=draft.typed,
            ),
        ]
    if not any(one.name == "pose" for one in view.actions):
        return []
    return ["", tr("[.] Type the pose, if an instrument fails")]


def _keys(view: View, body: TouchView) -> tuple[tuple[str, str], ...]:
    if body.free:
        (leave,) = view.actions
        return (("0", leave.label), (tr("Space"), leave.label), ("Esc", leave.label))
    types = {one.key for one in view.actions if one.name == "pose"}
    return tuple(one for one in keys_of(view) if one[0] not in types)
