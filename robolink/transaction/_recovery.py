"""What ``recover`` does after a crash: reads, settles what reading can settle, tells the rest.

It may be killed at any point and run again: each step looks at the controller anew, a tool
that holds its old value is never written, and so one write per tool is the most that ever
takes effect.
"""

from collections.abc import Callable
from dataclasses import dataclass

from robolink.errors import RobolinkError
from robolink.messages import tr
from robolink.model import Controller, EntryKind, Finding, Marker, MarkerKind, NewEntry
from robolink.transaction._settling import Settler

_ORDER = (
    MarkerKind.SET,
    MarkerKind.CHANGE,
    MarkerKind.MOVE,
    MarkerKind.SELECTION,
    MarkerKind.HISTORY,
)
"""What was in flight is judged before the change around it; the cell's tool comes after that."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a recovery found and did.

    Attributes:
        settled: What is closed now.
        left: What only a person can settle, with ``resolve``.
    """

    settled: tuple[Finding, ...]
    left: tuple[Finding, ...]


def recover(
    controller: Controller,
    *,
    keep: bool = False,
    tell: Callable[[Finding, bool], None] = lambda _finding, _settled: None,
) -> Recovery:
    """Settle what an earlier process left open, as far as reading the controller can.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay.
        tell: Told of each finding, and whether it is settled.

    Raises:
        BusyError: Somebody else is changing this controller just now.
        RobolinkError: A step failed; the rest stays open.
    """
    settler = Settler(controller, keep=keep)
    settled: list[Finding] = []
    left: list[Finding] = []
    with controller.outcomes.hold(tr("recover")):
        markers = sorted(controller.outcomes.open_markers(), key=_position)
        if markers:
            requests = [marker.request for marker in markers]
            controller.outcomes.append(
                NewEntry(EntryKind.RECONNECT, details={"unsettled": requests})
            )
        for marker in markers:
            finding = settler.examine(marker)
            decided = not finding.verdict.needs_a_person
            if decided:
                try:
                    settler.settle(finding)
                except RobolinkError as error:
                    error.remedy = " ".join(
                        (error.remedy, tr("'robolink recover' may be run again."))
                    ).strip()
                    raise
            (settled if decided else left).append(finding)
            tell(finding, decided)
    return Recovery(tuple(settled), tuple(left))


def _position(marker: Marker) -> int:
    return _ORDER.index(marker.kind)
