"""Values that were written without motion, and the later turn test that confirms one of them.

Such a value counts as proved only if the record of that controller shows, after it was written, a
turn test of the same tool that passed while the tool held the very same value, in a change that
ended with it. Another value in between proves nothing and spoils nothing: once the tool holds the
first one again, a test counts.
"""

from collections.abc import Iterable, Iterator
from typing import Final

from robolink.model import EntryKind, Recorded

KINDS: Final = (
    EntryKind.ORDER,
    EntryKind.INTENT,
    EntryKind.READ_BACK,
    EntryKind.DONE,
    EntryKind.ROLLED_BACK,
    EntryKind.NOT_APPLIED,
    EntryKind.CONFLICT,
    EntryKind.UNKNOWN,
    EntryKind.DECISION,
    EntryKind.VERIFY,
)
"""Entries that decide it."""

KEPT: Final = (EntryKind.DONE, EntryKind.DECISION)
"""How a change ends that is kept: if the tool held the value before, that is a decision."""


def proof_of(entries: Iterable[Recorded], order: str) -> int | None:
    """Return the number of the turn test that confirms what an order wrote.

    Args:
        entries: Those of :data:`KINDS` of one controller, oldest first, from the order on.
        order: Id of the order, which wrote without motion.

    Returns:
        Number of the test's entry; ``None`` where no test has confirmed it yet.

    Example:
        >>> from robolink.fleet import proof_of
        >>> proof_of([], "1a2b3c/line3-a") is None
        True
    """
    written: dict[int, list[object]] = {}
    tested: dict[tuple[str, int], int] = {}
    others: set[tuple[str, int]] = set()
    proofs: dict[int, int] = {}
    for entry in entries:
        if not written:
            if entry.kind is EntryKind.ORDER and entry.details.get("order") == order:
                written = dict(_tools(entry))
            continue
        tool = entry.tool
        if tool not in written or tool in proofs:
            continue
        key = entry.change, tool
        if entry.kind is EntryKind.VERIFY:
            # The last test of a change counts: one that was made again may fail.
            tested.pop(key, None)
            passed = entry.details.get("passed") is True and _is_settled(entry)
            if passed and key not in others:
                tested[key] = entry.number
            continue
        # What a later change found there may have come from a pendant.
        shown = "before" if entry.kind is EntryKind.INTENT else "value"
        if shown in entry.details and entry.details[shown] != written[tool]:
            others.add(key)
            tested = {one: number for one, number in tested.items() if one[1] != tool}
            continue
        if shown in entry.details:
            others.discard(key)
        if entry.kind in KEPT and "value" in entry.details and entry.change and key in tested:
            proofs[tool] = tested[key]
            if len(proofs) == len(written):
                return max(proofs.values())
    return None


def _tools(entry: Recorded) -> Iterator[tuple[int, list[object]]]:
    """Yield what an order left in each tool that it wrote."""
    tools = entry.details.get("tools")
    if isinstance(tools, dict):
        for number, value in tools.items():
            if isinstance(value, list):
                yield int(number), value


def _is_settled(entry: Recorded) -> bool:
    """Whether a test that passed did not contradict the statement of its measurement."""
    judgement = entry.details.get("judgement")
    return not (isinstance(judgement, dict) and judgement.get("code"))
