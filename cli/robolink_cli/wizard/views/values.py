"""The view of new values before they are written."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from robolink.calibration_run import LimitVerdict, Proposal, WriteSubject
from robolink.messages import tr
from robolink.model import ToolOffset, angle_difference_deg
from robolink_cli.wizard.state import Mark, WizardState
from robolink_cli.wizard.views.frame import JobStep, Part, coordinate_names, mm, signed
from robolink_cli.wizard.views.records import Action, ToolValues, ValueRow, ValuesView, Weight

if TYPE_CHECKING:
    from robolink.calibration import Impact  # numpy, which a touch does without

_LENGTHS = 3


def values_part(state: WizardState, subject: WriteSubject) -> Part:
    """Return the view of a proposal."""
    write = Action("write", tr("Write"), key="*", weight=Weight.MAIN, field="tool")
    reject = Action("reject", tr("Do not write"), key="Esc", weight=Weight.LEAVES)
    actions = (write, *_further(subject), reject)
    return Part(tr("New values"), values_view(state, subject), actions, JobStep.VALUES)


def values_view(state: WizardState, subject: WriteSubject) -> ValuesView:
    """Return what is to be written, what it does, and what has to be typed."""
    pairs = zip(subject.proposals, subject.verdicts, strict=True)
    numbers = ", ".join(map(str, subject.tools))
    return ValuesView(
        tuple(_tool(proposal, verdicts) for proposal, verdicts in pairs),
        tuple(taught_lines(state, subject)),
        tr("To write, type the tool number: {numbers}", numbers=numbers),
    )


def _tool(proposal: Proposal, verdicts: tuple[LimitVerdict, ...]) -> ToolValues:
    old, new = proposal.before, proposal.offset
    names = coordinate_names(*(one for one in (old, new) if one is not None))
    before = [""] * len(names) if old is None else [mm(one) for one in old.components()]
    change = [""] * len(names)
    if old is not None:
        shown = map(signed, _changes(old, new))
        change = [tr("stays") if not float(one) else one for one in shown]
    after = map(mm, new.components())
    rows = zip(names, before, after, change, strict=False)
    return ToolValues(
        proposal.tool,
        tuple(ValueRow(*row) for row in rows),
        tuple(_statements(proposal)),
        tuple(judgement(proposal, verdicts)),
    )


def _statements(proposal: Proposal) -> Iterator[str]:
    old, new = proposal.before, proposal.offset
    if old is not None:
        tip = math.dist(old.components()[:3], new.components()[:3])
        yield tr("The tip moves {d} mm.", d=mm(tip))
    yield from stated_lines(proposal)


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
    return [_at_points(state.impact, proposal, proposal.before), *lines]


def _at_points(impact: "Impact | None", proposal: Proposal, before: ToolOffset) -> str:
    moved = math.dist(before.components()[:3], proposal.offset.components()[:3])
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


def _further(subject: WriteSubject) -> tuple[Action, ...]:
    """Return what returns to the touches."""
    if subject.again is None:
        return ()
    again = Action("again", tr("Touch {k} again", k=subject.again), str(subject.again), key="/")
    if not subject.can_add_touch:
        return (again,)
    return again, Action("more", tr("One more touch"), key="+")


def judgement(
    proposal: Proposal, verdicts: tuple[LimitVerdict, ...]
) -> Iterator[tuple[str, str, str]]:
    """Yield what limits, notes and doubts say about a proposal: mark, its word, sentence."""
    from robolink.calibration import known_doubts

    look = (str(Mark.LOOK), tr("LOOK"))
    for verdict in verdicts:
        said = tr(
            "{name}: {mm} mm. Limit: {limit} mm.",
            name=verdict.name,
            mm=mm(verdict.found_mm),
            limit=mm(verdict.limit_mm),
        )
        yield (str(Mark.OK), tr("OK"), said) if verdict.passed else (*look, said)
    for doubt in (*proposal.notes, *known_doubts(proposal.result.warnings)):
        yield (*look, doubt)
    if "z_mm" in proposal.kept:
        z = mm((proposal.before or ToolOffset()).z_mm)
        yield (*look, tr("Z {z} is not measured; it stays.", z=z))


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
