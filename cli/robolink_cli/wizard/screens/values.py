"""Screen (f): the new values, and the question before they are written."""

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from robolink.calibration_run import LimitVerdict, Proposal, WriteSubject
from robolink.messages import tr
from robolink.model import ToolOffset, angle_difference_deg
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import (
    BODY,
    UPRIGHT,
    JobStep,
    Screen,
    broken,
    coordinate_names,
    mm,
    row_of,
    signed,
    title_row,
)
from robolink_cli.wizard.state import WizardState

if TYPE_CHECKING:
    from robolink.calibration import Impact  # numpy, which a touch does without

_HEAD = 18
_COLUMN = 11
_NARROW = 10
"""Width of a column when six columns of numbers are beside the names."""

_ROOM = BODY - 2
_LENGTHS = 3


def values_screen(state: WizardState, subject: WriteSubject) -> Screen:
    """Return the screen of a proposal; several tools in a short form."""
    typed = tr(
        "To write, type the tool number, then [*] or Space.   Tool: {typed}_", typed=state.typed
    )
    shown, pages = _shown(state, subject)
    onward = ((".", tr("The rest")),) if pages > 1 else ()
    return Screen(
        title_row(state, tr("New values"), JobStep.VALUES),
        (*shown, "", typed),
        (("*", tr("Write")), *_further(subject), *onward, ("Esc", tr("Do not write"))),
        message=state.message,
    )


def _shown(state: WizardState, subject: WriteSubject) -> tuple[list[str], int]:
    """Return what stands above the field, and the number of parts of the whole.

    Room is left for the field, a message and a second row of keys. Nothing is left out: before a
    write a person reads all of it.
    """
    lines = [*value_lines(subject), *taught_lines(state, subject)]
    rows = [row for line in lines for row in broken(line)]
    if len(rows) > _ROOM:
        rows = [row for row in rows if row.strip()]
    if len(rows) <= _ROOM:
        return rows, 1
    size = _ROOM - 1
    pages = -(-len(rows) // size)
    page = state.page % pages
    part = rows[page * size : (page + 1) * size]
    told = tr("Part {k} of {n}; [.] shows the rest.", k=page + 1, n=pages)
    return [*part, *[""] * (size - len(part)), told], pages


def taught_lines(state: WizardState, subject: WriteSubject) -> list[str]:
    """Return the effect of the write on programs, and what was found with the tool."""
    lines = [
        tr(
            "Stations found with tool {t}: {n} ({names}).",
            t=tool,
            n=len(names),
            names=", ".join(names),
        )
        for tool, names in subject.stations.items()
        if names
    ]
    if len(subject.proposals) > 1:
        return lines
    (proposal,) = subject.proposals
    if proposal.before is None:
        return lines
    return ["", *broken(_at_points(state.impact, proposal)), *lines]


def _at_points(impact: "Impact | None", proposal: Proposal) -> str:
    moved = math.dist(
        (proposal.before or ToolOffset()).components()[:3], proposal.offset.components()[:3]
    )
    if impact is None or impact.largest is None:
        return tr(
            "Programs using tool {t} will now run {d} mm differently. This corrects the "
            "present error.",
            t=proposal.tool,
            d=mm(moved),
        )
    return tr(
        "{n} taught points use tool {t}. Programs will run up to {d} mm differently there "
        "(most at P{p}). This corrects the present error.",
        n=len(impact.entries),
        t=proposal.tool,
        d=mm(impact.largest.distance_mm),
        p=impact.largest.number,
    )


def _further(subject: WriteSubject) -> tuple[tuple[str, str], ...]:
    """Return the keys that return to the touches."""
    if subject.again is None:
        return ()
    again = ("/", tr("Touch {k} again", k=subject.again))
    return (again, ("+", tr("One more touch"))) if subject.can_add_touch else (again,)


def value_lines(subject: WriteSubject) -> list[str]:
    """Return the table of old and new values, and what limits and doubts say of them."""
    several = len(subject.proposals) > 1
    lines: list[str] = []
    for proposal, verdicts in zip(subject.proposals, subject.verdicts, strict=True):
        lines += _table(proposal, short=several)
        if not several:
            lines += ["", *judgement(proposal, verdicts)]
    return lines


def judgement(proposal: Proposal, verdicts: tuple[LimitVerdict, ...]) -> list[str]:
    """Return what limits, notes and doubts say about a proposal."""
    from robolink.calibration import known_doubts

    lines = []
    for verdict in verdicts:
        mark = tr("OK") if verdict.passed else tr("LOOK")
        lines.append(
            f" {padded(mark, 5)}"
            + tr(
                "{name}: {mm} mm. Limit: {limit} mm.",
                name=verdict.name,
                mm=mm(verdict.found_mm),
                limit=mm(verdict.limit_mm),
            )
        )
    doubts = [*proposal.notes, *known_doubts(proposal.result.warnings)]
    lines += [
        f" {padded(tr('LOOK'), 5)}{row}" if first else f"      {row}"
        for doubt in doubts
        for first, row in ((at == 0, row) for at, row in enumerate(broken(doubt, 73)))
    ]
    if "z_mm" in proposal.kept:
        z = mm((proposal.before or ToolOffset()).z_mm)
        lines.append(f" {padded(tr('LOOK'), 5)}" + tr("Z {z} is not measured; it stays.", z=z))
    return lines


def _table(proposal: Proposal, *, short: bool) -> list[str]:
    old, new = proposal.before, proposal.offset
    names = coordinate_names(*(one for one in (old, new) if one is not None))

    def row(name: str, values: Iterable[str]) -> str:
        return padded(f" {name}", _HEAD) + row_of(
            [*values][: len(names)], _COLUMN if len(names) == len(UPRIGHT) else _NARROW
        )

    lines = [row(tr("Tool {n}", n=proposal.tool), names)]
    if old is not None:
        lines.append(row(tr("now"), map(mm, old.components())))
    lines.append(row(tr("new"), map(mm, new.components())))
    if old is not None:
        changes = map(signed, _changes(old, new))
        lines.append(row(tr("change"), (tr("stays") if not float(c) else c for c in changes)))
    if proposal.change_mm is not None and not short:
        tip = math.dist((old or new).components()[:3], new.components()[:3])
        lines += ["", tr("The tip moves {d} mm.", d=mm(tip))]
    if not short:
        lines += stated_lines(proposal)
    return lines


def _changes(old: ToolOffset, new: ToolOffset) -> Iterator[float]:
    """Yield the change of each component, mm and degrees."""
    for number, (before, after) in enumerate(zip(old.components(), new.components(), strict=True)):
        yield after - before if number < _LENGTHS else angle_difference_deg(after, before)


def stated_lines(proposal: Proposal) -> list[str]:
    """Return the repeatability and accuracy of the new values, and the largest row."""
    from robolink.calibration import largest_row_sentence, statement_line

    line, accuracy = statement_line(proposal.result), proposal.result.accuracy
    lines = [line] if line else []
    if line and accuracy is not None:
        lines.append(largest_row_sentence(accuracy))
    if line and proposal.seating is not None:
        lines.append(proposal.seating.sentence)
    return lines
