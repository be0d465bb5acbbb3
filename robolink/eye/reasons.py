"""What was found in a picture, and why something was refused, in words."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode
from robolink.messages import joined, tr

__all__ = ["candidate_line", "candidates_summary", "reason"]

_PERCENT: Final = frozenset(
    {
        RefusalCode.FEW_RAYS,
        RefusalCode.NO_BORE,
        RefusalCode.BORE_ASIDE,
        RefusalCode.NOT_ROUND,
        RefusalCode.OTHER_BORE,
    }
)
"""Codes whose two numbers are shares; a person reads percent."""

_Words = Callable[[float, float], str]

_WORDS: Final[Mapping[RefusalCode, _Words]] = {
    RefusalCode.FEW_RAYS: lambda measured, limit: tr(
        "only {measured:.0f} % of its rim is visible; at least {limit:.0f} % is needed",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.NO_BORE: lambda measured, limit: tr(
        "no bore in its middle: {measured:.0f} % of a bore's rim is visible; at least "
        "{limit:.0f} % is needed (for a solid tip: bore = false in the cell file)",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.BORE_ASIDE: lambda measured, limit: tr(
        "its bore is off the middle by {measured:.0f} % of its radius; {limit:.0f} % is allowed",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.FAINT_EDGE: lambda measured, limit: tr(
        "its edge is too faint: {measured:.1f} grey levels; at least {limit:.1f} are needed",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.CUT: lambda _measured, _limit: tr("the edge of the picture cuts it"),
    RefusalCode.OTHER_RADIUS: lambda _measured, _limit: tr(
        "it is not as wide as what is looked for"
    ),
    RefusalCode.BLURRED: lambda measured, limit: tr(
        "out of focus: its edge is {measured:.1f} px wide; {limit:.1f} px is allowed",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.NOT_ROUND: lambda measured, limit: tr(
        "it is not round: {measured:.0f} %, limit {limit:.0f} %", measured=measured, limit=limit
    ),
    RefusalCode.OTHER_BORE: lambda measured, limit: tr(
        "its bore is {measured:.0f} % as wide as its face, limit {limit:.0f} %",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.NOT_FILLED: lambda measured, limit: tr(
        "its inside is uneven: {measured:.2f}, limit {limit:.2f}", measured=measured, limit=limit
    ),
    RefusalCode.POOR_FIT: lambda measured, limit: tr(
        "its outline does not fit: {measured:.2f}, limit {limit:.2f}",
        measured=measured,
        limit=limit,
    ),
    RefusalCode.OTHER_MARK: lambda _measured, _limit: tr("it is another mark"),
    RefusalCode.INSIDE_ANOTHER: lambda _measured, _limit: tr("it lies inside another circle"),
    RefusalCode.WORSE_THAN_ANOTHER: lambda _measured, _limit: tr(
        "another circle at the same place fits better"
    ),
}


def reason(refusal: CandidateRefusal) -> str:
    """Return why something is not taken for a tip, a clause with its two numbers."""
    by = 100.0 if refusal.code in _PERCENT else 1.0
    return _WORDS[refusal.code](by * refusal.measured, by * refusal.limit)


def candidate_line(number: int, candidate: Candidate) -> str:
    """Return one line about something that was found.

    Args:
        number: Its number in the picture, from 1.
        candidate: What was found.
    """
    facts = [
        tr("X {x:.2f} Y {y:.2f} px", x=candidate.x_px, y=candidate.y_px),
        tr("radius {radius:.2f} px", radius=candidate.radius_px),
    ]
    if candidate.edge_px is not None:
        facts.append(tr("edge {edge:.1f} px", edge=candidate.edge_px))
    if candidate.bore_ratio is not None:
        facts.append(tr("bore {share:.0f} %", share=100.0 * candidate.bore_ratio))
    facts.append(tr("score {score:.2f}", score=candidate.score))
    if candidate.accepted:
        judged = tr("accepted")
    else:
        judged = tr("refused: {why}", why=joined("; ", map(reason, candidate.refused)))
    return joined(": ", (str(number), joined(", ", facts), judged))


def candidates_summary(candidates: Sequence[Candidate]) -> str:
    """Return what a picture comes to, one sentence."""
    accepted = sum(one.accepted for one in candidates)
    if accepted == 1:
        return tr("One tip found.")
    if accepted:
        return tr("{count} tips found; only one may be in the picture.", count=accepted)
    if candidates:
        return tr("No tip found: everything that looks like one was refused.")
    return tr("No tip found: nothing in the picture looks like one.")
