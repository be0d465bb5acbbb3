"""The rules that hold whatever happens. Each has a name, and looks past the driver.

What is allowed where two rules meet is that of docs/reference/rules.md: after a stop the old tool
may be selected, and each tool of an open change written back once (5); what a lost answer, a lost
disk or a hand at the pendant leaves open counts as told when an open marker, or the error, says so.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from robolink_cli.console.exit_codes import BUG, UNKNOWN, exit_code

from robolink.model import ToolOffset, read_offset
from robolink.nozzle_change import ChangeReport
from robolink.standing import Effect, standing_after
from robolink_simulators.soak.books import BookedMarker, Books
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Hour
from robolink_simulators.soak.people import OTHERS_TOOL, TOOL, Wish
from robolink_simulators.soak.plant.machine import (
    MachineState,
    PlantMachine,
    SentKind,
    SentRequest,
)
from robolink_simulators.soak.story import Story

NAMES: Final = (
    "MovesOnce",
    "StillAfterStop",
    "NoSuccessAfterStop",
    "AtRestWhenStopped",
    "OnlyWantedValues",
    "KeptOnProof",
    "NoMotionInDoubt",
    "NothingWithoutRecord",
    "NoWriteWithoutLease",
    "BooksAgree",
    "ExitCodeIsTrue",
    "StateIsTold",
    "SameToolSelected",
    "TipIsWhereItSays",
    "NoProofWithoutTouch",
    "NoDefectShown",
    "UsableAgain",
    "NoPasswordShown",
    "NothingGrows",
)
"""Every rule, in the order in which they are listed."""

_SURELY_MM: Final = 0.5
"""A tip that was certified and lies farther off than this is a wrong certificate in any case."""


@dataclass(slots=True)
class HourSoFar:
    """What the rules know of the hour that runs.

    Attributes:
        hour: The hour.
        wish: What its person means to be true at its end.
        first: What the machine kept at its beginning.
        before: What it kept at the beginning of the last try.
        entries: The newest entry at its beginning.
        old_markers: What was open before the last try, by operation.
        moves: Operations under which a movement has left, with how often.
        movements: How many the machine had begun.
        wanted: What each tool may hold.
        foreign: Tools written, and whether a tool was selected, by somebody else.
        report: Of a tip that was measured and proved.
        crowded: Whether a second person was at work.
    """

    hour: Hour
    wish: Wish
    first: MachineState
    before: MachineState
    entries: int
    old_markers: frozenset[str]
    movements: int
    moves: dict[str, int] = field(default_factory=dict)
    wanted: dict[int, list[ToolOffset | None]] = field(default_factory=dict)
    report: ChangeReport | None = None
    crowded: bool = False
    selects: set[int] = field(default_factory=set)


class Rulebook:
    """Checks the rules of one cell.

    Args:
        story: Where a broken rule is noted.
        plant: The machine.
        books: The journal on the disk.

    Attributes:
        now: The hour that runs.
    """

    now: HourSoFar

    def __init__(self, story: Story, plant: PlantMachine, books: Books) -> None:
        self._story = story
        self._plant = plant
        self._books = books
        self._by_others: dict[int, ToolOffset | None] = {}

    def begin(self, hour: Hour, wish: Wish) -> None:
        """Begin an hour."""
        state = self._plant.state()
        self.now = HourSoFar(
            hour,
            wish,
            state,
            state,
            self._books.last_number(),
            frozenset(marker.operation for marker in self._books.markers()),
            self._plant.movements,
        )
        for tool, offset in state.tools.items():
            self.now.wanted[tool] = [offset]
        self._plant.touched.clear()
        self._plant.moved_itself = False

    def begin_again(self) -> None:
        """Begin another try in the same hour; what is open by now is of before."""
        self.now.before = self._plant.state()
        self.now.old_markers = frozenset(m.operation for m in self._books.markers())
        self.now.report = None

    def hold(self, rule: str, holds: bool, sentence: str) -> None:
        """Look at a rule; ``sentence`` says what was seen where it does not hold."""
        self._story.checks[rule] += 1
        if not holds:
            self._story.break_rule(rule, sentence)

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave a process."""
        if sent.kind in (SentKind.OTHER, SentKind.STOP):
            return
        markers = self._books.markers()
        if process.stopped_ns is not None:
            self._after_stop(process, sent, markers)
        if not self._books.trusted:
            return
        if sent.kind is SentKind.MOVE:
            self._moves(process, sent, markers)
        elif sent.kind is SentKind.WRITE:
            self._writes(process, sent, markers)
        holder = self._books.holder()
        mine = holder is not None and holder.get("pid") == process.number
        putting_back = any(m.kind in ("change", "selection") for m in markers)
        self.hold(
            "NoWriteWithoutLease",
            mine or (putting_back and sent.kind is SentKind.SELECT),
            f"{sent.text} leaves process {process.number}, the lease is of {holder}",
        )

    def _moves(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        mine = [m for m in markers if m.kind == "move" and m.operation not in self.now.moves]
        self.hold(
            "MovesOnce",
            bool(mine),
            f"{sent.text} leaves without a marker of its own; open are "
            f"{[m.request for m in markers]}",
        )
        for marker in mine[-1:]:
            self.now.moves[marker.operation] = 1
        doubts = [
            m.request
            for m in markers
            if m.operation in self.now.old_markers and m.kind != "selection"
        ]
        others = [m.request for m in markers if m.kind == "set"]
        self.hold(
            "NoMotionInDoubt",
            not doubts and not others,
            f"{sent.text} leaves process {process.number} although {doubts + others} is open",
        )

    def _writes(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        tool = sent.tool
        ours = [m for m in markers if m.kind == "set" and m.details.get("tool") == tool]
        whole = [m for m in markers if m.kind == "change" and str(tool) in m.details["tools"]]
        self.hold(
            "NothingWithoutRecord",
            bool(ours or whole),
            f"{sent.text} leaves process {process.number} without a marker",
        )
        wanted = self.now.wanted.setdefault(tool or 0, [None])
        for marker in ours:
            wanted.append(read_offset(marker.details.get("requested")))
            wanted.append(read_offset(marker.details.get("before")))

    def _after_stop(
        self, process: VirtualProcess, sent: SentRequest, markers: Sequence[BookedMarker]
    ) -> None:
        allowed = False
        if sent.kind is SentKind.SELECT:
            named = [m for m in markers if m.kind in ("selection", "change")]
            allowed = bool(named) or not self._books.trusted
        elif sent.kind is SentKind.WRITE and sent.tool not in process.put_back:
            allowed = sent.tool in self.now.wanted
            process.put_back.add(sent.tool or 0)
        self.hold("StillAfterStop", allowed, f"{sent.text} leaves after the stop was acknowledged")

    def stopped(self, process: VirtualProcess) -> None:
        """Check the machine at the moment in which a stop is acknowledged."""
        self.hold("AtRestWhenStopped", not self._plant.moving, "it still moves")
        del process

    def ended(
        self, process: VirtualProcess, error: BaseException | None, state: MachineState
    ) -> None:
        """Check how a deed ended, against what the machine keeps now."""
        if error is None:
            self._succeeded(process, state)
        code = 0 if error is None else exit_code(error)
        self.hold("NoDefectShown", code != BUG, f"{type(error).__name__}: {error}")
        self._told(error, code, state)
        if self._books.trusted and code != UNKNOWN:
            begun = [
                m.request
                for m in self._books.markers()
                if m.operation not in self.now.old_markers and m.kind != "selection"
            ]
            self.hold(
                "ExitCodeIsTrue",
                not begun or self.now.crowded,
                f"it ends with {code}, and {begun} is open",
            )

    def _succeeded(self, process: VirtualProcess, state: MachineState) -> None:
        self.hold(
            "NoSuccessAfterStop",
            process.stopped_ns is None,
            "it ends well although a stop was acknowledged",
        )
        for tool, offset in self.now.wish.typed:
            self.hold(
                "StateIsTold",
                tool in self._plant.touched or self._plant.same(state.tools.get(tool), offset),
                f"tool {tool} was to hold {offset}, it holds {state.tools.get(tool)}",
            )
        report = self.now.report
        if report is not None:
            self._certified(report, state)

    def _certified(self, report: ChangeReport, state: MachineState) -> None:
        (done,) = report.tools
        truth = self._plant.simulator.world.tips[TOOL]
        found = done.proposal.offset
        error_mm = math.hypot(found.x_mm - truth.x_mm, found.y_mm - truth.y_mm)
        self.hold(
            "StateIsTold",
            TOOL in self._plant.touched or self._plant.same(state.tools.get(TOOL), found),
            f"tool {TOOL} was proved as {found}, it holds {state.tools.get(TOOL)}",
        )
        habit = self.now.hour.habit
        self.hold(
            "NoProofWithoutTouch",
            habit.stays_share < 1.0,
            "a tip was proved that nobody brought onto the pin",
        )
        if habit.careful or habit.declines:
            within_mm = done.proposal.result.known_within_mm or 0.1
            self._story.certified.append(error_mm <= within_mm)
            self.hold(
                "TipIsWhereItSays",
                error_mm <= _SURELY_MM,
                f"the tip is {error_mm:.3f} mm from where it was proved to be",
            )

    def _told(self, error: BaseException | None, code: int, state: MachineState) -> None:
        """Check what the end says of the controller."""
        if error is None:
            return
        standing = standing_after(error)
        foreign = self._plant.touched | ({OTHERS_TOOL} if self.now.crowded else set())
        for tool, stands in standing.tools.items():
            if not stands.known or tool in foreign:
                continue
            holds = None if stands.holds is None else ToolOffset(*stands.holds)
            self.hold(
                "StateIsTold",
                self._plant.same(holds, state.tools.get(tool)),
                f"tool {tool} is told to hold {holds}, it holds {state.tools.get(tool)}",
            )
        changed = [
            tool
            for tool in {*self.now.before.tools, *state.tools}
            if not self._plant.same(self.now.before.tools.get(tool), state.tools.get(tool))
        ]
        for tool in changed:
            self.hold(
                "StateIsTold",
                tool in foreign or tool in standing.tools or code == UNKNOWN,
                f"tool {tool} has changed, which {type(error).__name__} does not say",
            )
        selected = standing.selected
        if standing.selection_known and selected is not None and not self._plant.moved_itself:
            self.hold(
                "StateIsTold",
                selected == state.selected,
                f"tool {selected} is told to be selected, it is {state.selected}",
            )
        if standing.effect is Effect.UNCHANGED and not self._plant.moved_itself:
            self.hold(
                "StateIsTold",
                state.selected == self.now.before.selected or bool(self._open_selection()),
                f"unchanged is told, but tool {state.selected} is selected",
            )

    def _open_selection(self) -> list[BookedMarker]:
        if not self._books.trusted:
            return [BookedMarker("", "selection", "", {})]
        return [m for m in self._books.markers() if m.kind == "selection" or "select" in m.details]

    def left(self, state: MachineState) -> None:
        """Check what a deed left behind, however it ended, killed or not, before anybody acts."""
        if state.selected != self.now.before.selected and not self._plant.moved_itself:
            self.hold(
                "SameToolSelected",
                bool(self._open_selection()) or state.selected == self.now.wish.selects,
                f"tool {state.selected} is selected in place of {self.now.before.selected}, and "
                "nothing on record says so",
            )
        if not self._books.trusted:
            return
        markers = self._books.markers()
        for tool in {*self.now.before.tools, *state.tools}:
            holds = state.tools.get(tool)
            named = [
                m
                for m in markers
                if m.details.get("tool") == tool or str(tool) in m.details.get("tools", {})
            ]
            self._agrees(tool, holds, named)

    def _agrees(self, tool: int, holds: ToolOffset | None, named: Sequence[BookedMarker]) -> None:
        known, value = self._books.value_of(tool)
        if tool in self._plant.touched:
            self._by_others[tool] = holds
        if tool in self._by_others and self._plant.same(self._by_others[tool], holds):
            return
        if tool in self._plant.touched or named:
            return
        self.hold(
            "BooksAgree",
            not known or self._plant.same(value, holds),
            f"tool {tool} is on record as {value}, it holds {holds}, and nothing is open",
        )
        wanted = self.now.wanted.get(tool, [None])
        self.hold(
            "OnlyWantedValues",
            any(self._plant.same(one, holds) for one in wanted),
            f"tool {tool} holds {holds}, which nobody wanted: {wanted}",
        )

    def at_rest(self, state: MachineState, *, usable: bool, why: str) -> None:
        """Check the cell after its people have put it right."""
        self.hold("UsableAgain", usable, f"nobody gets it going again: {why}")
        if not usable:
            return
        self.hold("SameToolSelected", state.selected == TOOL, f"tool {state.selected} is selected")
        begun = self._plant.movements - self.now.movements
        self.hold(
            "MovesOnce",
            begun <= len(self.now.moves) or not self._books.trusted,
            f"{begun} movements were begun under {len(self.now.moves)} markers",
        )
        if not self._books.trusted:
            return
        for tool in {*self.now.first.tools, *state.tools}:
            holds, before = state.tools.get(tool), self.now.first.tools.get(tool)
            self._agrees(tool, holds, ())
            if tool in self._plant.touched or self._plant.same(holds, before):
                continue
            self.hold("KeptOnProof", self._proved(tool, holds), f"tool {tool} keeps {holds}")

    def _proved(self, tool: int, holds: ToolOffset | None) -> bool:
        """Tell whether a new value rests on a proof, or on a person's word."""
        if any(n == tool and self._plant.same(offset, holds) for n, offset in self.now.wish.typed):
            return True
        if self.now.wish.undoes or self.now.hour.habit.keeps:
            return True
        verdicts = self._books.verdicts(self.now.entries, tool)
        return any(kind == "done" and verdict == "verified" for kind, verdict in verdicts)
