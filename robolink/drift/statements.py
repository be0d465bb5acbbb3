"""What the last change of each tool is repeatable to and accurate to, beside the charts.

Charts compare the changes of one cell with each other, so their limits are those of scatter: an
error that all of them share, such as a person who always sees contact on one side, moves every
value alike and is in none of the limits. Only the statement of accuracy has it
(docs/reference/evidence.md 14, 19).
"""

from collections.abc import Iterator, Sequence

from robolink.calibration import stated_mm
from robolink.drift.history import MeasuredChange
from robolink.messages import tr


def last_statements(changes: Sequence[MeasuredChange]) -> Iterator[str]:
    """Yield a sentence for each tool whose last change has a statement on record.

    Args:
        changes: The changes of one controller, oldest first.

    Example:
        >>> from robolink.drift import MeasuredChange, last_statements
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "", "", tip_mm, None, 0.05, 0.024, 0.064)
        >>> list(last_statements([change]))
        ['Tool 1, last change: repeatable to +-0.024 mm, accurate to +-0.064 mm (95 %).']
    """
    for tool, last in sorted({change.tool: change for change in changes}.items()):
        if last.accurate_to_mm is None:
            continue
        accurate = stated_mm(last.accurate_to_mm)
        if last.repeatable_to_mm is None:
            yield tr(
                "Tool {tool}, last change: repeatable: not known, accurate to +-{u} mm (95 %).",
                tool=tool,
                u=accurate,
            )
        else:
            yield tr(
                "Tool {tool}, last change: repeatable to +-{r} mm, accurate to +-{u} mm (95 %).",
                tool=tool,
                r=stated_mm(last.repeatable_to_mm),
                u=accurate,
            )
