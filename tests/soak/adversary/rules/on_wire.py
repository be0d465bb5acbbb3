"""The requests that may leave a process, and when."""

from collections.abc import Sequence

from robolink.model import ToolOffset, read_offset
from tests.soak.adversary.books import BookedMarker
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.plant.machine import SentKind, SentRequest
from tests.soak.adversary.rules.grounds import Grounds


class WireRules:
    """Checks each request before it leaves.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave a process."""
        self._on.hold("SessionEnds", not sent.forbidden, f"{sent.text} leaves: {sent.forbidden}")
        if sent.kind in (SentKind.OTHER, SentKind.STOP):
            return
        markers = self._on.books.markers()
        if process.stopped_ns is not None:
            self._after_stop(process, sent, markers)
        if self._on.books.lost and sent.kind in (SentKind.MOVE, SentKind.WRITE):
            self._on.hold("LossIsNoticed", False, f"{sent.text} leaves, the journal is gone")
        if not self._on.books.trusted:
            return
        if sent.kind is SentKind.MOVE:
            self._moves(process, sent, markers)
        elif sent.kind is SentKind.WRITE:
            self._writes(process, sent, markers)
        holder = self._on.books.holder()
        mine = holder is not None and holder.get("pid") == process.number
        putting_back = any(m.kind in ("change", "selection") for m in markers)
        self._on.hold(
            "NoWriteWithoutLease",
            mine or (putting_back and sent.kind is SentKind.SELECT),
            f"{sent.text} leaves process {process.number}, the lease is of {holder}",
        )

    def _moves(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        if self._on.plant.numbered and sent.text == self._on.now.last_move:
            # The very same block, because it arrived damaged: its number keeps it from counting
            # twice, as the count of the machine's own movements shows.
            return
        self._on.now.last_move = sent.text
        mine = [m for m in markers if m.kind == "move" and m.operation not in self._on.now.moves]
        self._on.hold(
            "MovesOnce",
            bool(mine),
            f"{sent.text} leaves without a marker of its own; open are "
            f"{[m.request for m in markers]}",
        )
        for marker in mine[-1:]:
            self._on.now.moves[marker.operation] = 1
        doubts = [
            m.request
            for m in markers
            if m.operation in self._on.now.old_markers and m.kind != "selection"
        ]
        others = [m.request for m in markers if m.kind == "set"]
        self._on.hold(
            "NoMotionInDoubt",
            not doubts and not others,
            f"{sent.text} leaves process {process.number} although {doubts + others} is open",
        )

    def _writes(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        tool = sent.tool
        ours = _of_tool(tool, markers)
        for marker in ours:
            self._on.now.writes.setdefault(marker.operation, sent.text)
        whole = [m for m in markers if m.kind == "change" and str(tool) in m.details["tools"]]
        self._on.hold(
            "NothingWithoutRecord",
            bool(ours or whole),
            f"{sent.text} leaves process {process.number} without a marker",
        )
        self._not_again(sent, ours)
        wanted = self._on.now.wanted.setdefault(tool or 0, [None])
        for marker in ours:
            wanted.append(read_offset(marker.details.get("requested")))
            wanted.append(read_offset(marker.details.get("before")))

    def _not_again(self, sent: SentRequest, ours: Sequence[BookedMarker]) -> None:
        """Check that a stored value is not written again: a write wears the memory."""
        tool, plant = sent.tool or 0, self._on.plant
        # The mark of an earlier write stays if nothing can be stored any more.
        ours = [m for m in ours if self._on.now.writes[m.operation] == sent.text]
        if not ours or tool in plant.touched or self._on.now.crowded or plant.bent:
            return  # somebody else may have written it since it was read
        new, holds = read_offset(ours[-1].details.get("requested")), plant.shown(tool)
        self._on.hold(
            "ContractHolds",
            not plant.same(new, holds),
            f"{sent.text} leaves, and tool {tool} holds {holds} already",
        )

    def given(self, tool: int, value: ToolOffset) -> None:
        """Check a value that the machine's own program is about to get and write."""
        if not self._on.books.trusted:
            return
        whole = [
            marker
            for marker in self._on.books.markers()
            if marker.kind == "change" and str(tool) in marker.details["tools"]
        ]
        self._on.hold(
            "NothingWithoutRecord",
            any(
                self._on.plant.same(read_offset(m.details["tools"][str(tool)]["requested"]), value)
                for m in whole
            ),
            f"the program is given {value} for tool {tool} without a marker",
        )

    def _after_stop(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        allowed = False
        if sent.kind is SentKind.SELECT:
            named = [m for m in markers if m.kind in ("selection", "change")]
            allowed = bool(named) or not self._on.books.trusted
        elif sent.kind is SentKind.WRITE and sent.tool:
            once = process.put_back.setdefault(sent.tool, sent.text)
            allowed = once == sent.text and self._puts_back(sent, markers)
        self._on.hold(
            "StillAfterStop", allowed, f"{sent.text} leaves after the stop was acknowledged"
        )

    def _puts_back(self, sent: SentRequest, markers: Sequence[BookedMarker]) -> bool:
        """Return whether the marked write restores the earlier value."""
        if not self._on.books.trusted:
            return True
        tool = sent.tool or 0
        left = self._on.now.writes  # as in _not_again
        ours = [m for m in _of_tool(tool, markers) if left.get(m.operation, sent.text) == sent.text]
        wanted = read_offset(ours[-1].details.get("requested")) if ours else None
        before: list[ToolOffset | None] = [
            self._on.now.first.tools.get(tool),
            self._on.now.before.tools.get(tool),
            self._on.now.agreed.tools.get(tool),  # a deed's second change begins with its first
            self._on.plant.by_hand.get(tool),  # it was there before the change, if not at first
        ]
        # A marker that could no longer be stored: the change around it has its data.
        return not ours or any(self._on.plant.same(one, wanted) for one in before)


def _of_tool(tool: int | None, markers: Sequence[BookedMarker]) -> list[BookedMarker]:
    """Return the markers of writes of a tool."""
    return [m for m in markers if m.kind == "set" and m.details.get("tool") == tool]
