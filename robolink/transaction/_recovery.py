"""What ``recover`` does after a crash: reads, settles what reading can settle, asks for the rest.

It may be killed at any point and run again: each step looks at the controller anew, a tool
that holds its old value is never written, and so one write per tool is the most that ever
takes effect.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from robolink.errors import ConfigError, JournalError, RobolinkError
from robolink.messages import tr
from robolink.model import Controller, EntryKind, Finding, Marker, MarkerKind, NewEntry, Verdict
from robolink.transaction._settling import Settler

_ORDER = (
    MarkerKind.SET,
    MarkerKind.CHANGE,
    MarkerKind.SELECTION,
    MarkerKind.MOVE,
    MarkerKind.HISTORY,
)
"""What was in flight is judged before the change around it. Whether a movement was as it should
be takes a person, who looks at the cell when its own tool is selected again."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a recovery found and did.

    Attributes:
        settled: What is closed now.
        left: What takes a person's word, and did not get it.
    """

    settled: tuple[Finding, ...]
    left: tuple[Finding, ...]


def recover(
    controller: Controller,
    *,
    keep: bool = False,
    confirm: Callable[[Finding], bool] = lambda _finding: False,
    tell: Callable[[Finding, bool], None] = lambda _finding, _settled: None,
    later: Collection[str] = (),
) -> Recovery:
    """Settle what an earlier process left open: by reading, and with a person's word.

    Nothing that moved or was written is sent again. What was sent and not answered is fenced off
    first, so that nothing arrives behind the look that settles it; on a PLC that takes the
    mailbox, and may take the ten seconds for which a dead process keeps it.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay.
        confirm: Asked about each finding that reading cannot settle; true where a person has
            looked and work may go on.
        tell: Told of each finding, and whether it is settled. A command that was part of a change
            or a procedure is told of with that, not by itself.
        later: Operations of markers that are left alone: the caller settles them.

    Raises:
        BusyError: Somebody else is changing this controller just now.
        LeaseHeldError: Another program commands the PLC; nothing is settled.
        RobolinkError: A step failed; the rest stays open.

    Example:
        >>> import robolink
        >>> from robolink.transaction import recover
        >>> with robolink.connect("epson+sim://recover-example") as controller:
        ...     print(recover(controller).left)
        ()
    """
    with controller.outcomes.hold(tr("recover")), controller.signs_of_life():
        markers = [
            marker
            for marker in _in_order(controller.outcomes.open_markers())
            if marker.operation not in later
        ]
        if markers:
            requests = [marker.request for marker in markers]
            controller.outcomes.append(
                NewEntry(EntryKind.RECONNECT, details={"unsettled": requests})
            )
        return _Recovering(Settler(controller, keep=keep), markers, confirm, tell).run()


def look(
    controller: Controller,
    *,
    keep: bool = False,
    tell: Callable[[Finding], None] = lambda _finding: None,
) -> tuple[Finding, ...]:
    """Return what :func:`recover` would find, and tell what it would; reads only.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified would stay.
        tell: Told of each finding.

    Example:
        >>> import robolink
        >>> from robolink.transaction import look
        >>> with robolink.connect("epson+sim://look-example") as controller:
        ...     look(controller)
        ()
    """
    settler = Settler(controller, keep=keep, only_looks=True)
    markers = _in_order(controller.outcomes.open_markers())
    findings = tuple(_examined(settler, marker) for marker in markers)
    for finding in findings:
        if _told_with(finding.marker, markers) is None:
            tell(finding)
    return findings


def _in_order(markers: Sequence[Marker]) -> list[Marker]:
    """Return markers in the order in which they are settled."""
    return sorted(markers, key=lambda marker: _ORDER.index(marker.kind))


def _told_with(marker: Marker, others: Sequence[Marker]) -> Marker | None:
    """Return the open change or procedure of which a command was a part, ``None`` for none.

    What was found out about the command is overtaken by what becomes of the whole: a tool that
    holds the new value, and a moment later the old one again.
    """
    if marker.kind is not MarkerKind.SET:
        return None
    for other in others:
        if other.kind is MarkerKind.CHANGE and "tool" in marker.details:
            change = other.details.get("change")
            if change and change == marker.details.get("change"):
                return other
        if other.kind is MarkerKind.SELECTION and "select" in marker.details:
            return other
    return None


class _Recovering:
    """One recovery, marker by marker."""

    def __init__(
        self,
        settler: Settler,
        markers: Sequence[Marker],
        confirm: Callable[[Finding], bool],
        tell: Callable[[Finding, bool], None],
    ) -> None:
        self._settler = settler
        self._markers = markers
        self._confirm = confirm
        self._tell = tell
        self._settled: list[Finding] = []
        self._left: list[Finding] = []
        self._waiting: list[tuple[Marker, Finding]] = []

    def run(self) -> Recovery:
        for marker in self._markers:
            finding = _examined(self._settler, marker)
            whole = _told_with(marker, self._markers)
            if whole is not None and finding.verdict.needs_a_person:
                self._waiting.append((whole, finding))
                continue
            decided = not finding.verdict.needs_a_person or self._confirm(finding)
            self._end(finding, decided=decided)
            if whole is None:
                self._tell(finding, decided)
            for part in [part for of, part in self._waiting if of is marker]:
                self._end(part, decided=decided)
        return Recovery(tuple(self._settled), tuple(self._left))

    def _end(self, finding: Finding, *, decided: bool) -> None:
        if not decided:
            self._left.append(finding)
            return
        try:
            self._settler.settle(finding)
        except RobolinkError as error:
            error.remedy = " ".join(
                (error.remedy, tr("'robolink recover' may be run again."))
            ).strip()
            raise
        self._settled.append(finding)


def _examined(settler: Settler, marker: Marker) -> Finding:
    try:
        return settler.examine(marker)
    except JournalError:
        raise
    except ConfigError as error:
        # Written by something else: a person looks, and it is forgotten on his word.
        return Finding(marker, Verdict.LOOK, error.what)
