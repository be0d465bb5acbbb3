"""The end of a deed: its report compared with the facts, and its leftovers."""

import math
import re
from collections.abc import Sequence
from typing import Final

from robolink_cli.console.exit_codes import BUG, UNKNOWN, exit_code

from robolink.calibration_run import ChangeReport
from robolink.controller_outcome import Effect, outcome_after
from robolink.errors import (
    ConfigError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    TransportError,
)
from robolink.model import ToolOffset
from tests.soak.adversary.books import BookedMarker
from tests.soak.adversary.command_lines import selects
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import Hindrance
from tests.soak.adversary.people import OTHERS_TOOL, TOOL
from tests.soak.adversary.plant.machine import MachineState
from tests.soak.adversary.rules.grounds import SURELY_MM, TOLERANCE_MM, Grounds, chain

_HARM_THE_JOURNAL: Final = (Hindrance.DISK, Hindrance.POWER_CUT)
_OUT_OF_REACH: Final = (
    OutcomeUnknownError,
    TransportError,
    RemoteProtocolError,
    LeaseLostError,
    ConfigError,
)
"""After these nothing can be restored: link, right to write, or record is gone."""

_TRIED: Final = {"rolled back", "not applied", "conflict", "unknown"}
"""The journal's words for a tool that was, or could not be, restored."""


class EndRules:
    """Checks a deed that has ended by itself.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds

    def ended(
        self, process: VirtualProcess, error: BaseException | None, state: MachineState
    ) -> None:
        """Check the reported end of a deed against the machine's present state."""
        if error is None:
            self._succeeded(process, state)
        code = 0 if error is None else exit_code(error)
        self._on.hold("NoDefectShown", code != BUG, f"{type(error).__name__}: {error}")
        self._told(error, code, state)
        self._taken_back(process, error, state)
        self._on.hold(
            "ExitCodeIsTrue",
            code == UNKNOWN or not process.overtaken,
            f"it ends with {code}, and another client was answered in place of it",
        )
        unsure = any(one.what == "SYNC_FAILS" for one in self._on.now.hour.disturbances)
        # A program that calls back reports its leftovers when it calls again.
        if self._on.books.trusted and code != UNKNOWN and not self._on.plant.calls_back:
            begun = [
                m.request
                for m in self._on.books.markers()
                if m.operation not in self._on.now.old_markers
                and m.kind != "selection"
                and not (unsure and self._unsent(m))
            ]
            self._on.hold(
                "ExitCodeIsTrue",
                not begun or self._on.now.crowded,
                f"it ends with {code}, and {begun} is open",
            )

    def _unsent(self, marker: BookedMarker) -> bool:
        """Return whether nothing has left under a marker.

        If its sync failed it counted as not stored, and yet the disk may have it.
        """
        now = self._on.now
        if marker.kind == "change":
            return not now.writes
        return marker.operation not in now.writes and marker.operation not in now.moves

    def _taken_back(
        self, process: VirtualProcess, error: BaseException | None, state: MachineState
    ) -> None:
        """Check that a failed change tried to restore the old values where it could."""
        hour = self._on.now.hour
        harmed = any(one.kind in _HARM_THE_JOURNAL for one in hour.disturbances)
        gone = process.cut_off or any(isinstance(one, _OUT_OF_REACH) for one in chain(error))
        if error is None or gone or harmed or self._on.now.crowded or not self._on.books.trusted:
            return
        for marker in self._on.books.markers():
            if marker.kind != "change" or marker.operation in self._on.now.old_markers:
                continue
            for tool in map(int, marker.details["tools"]):
                before, holds = self._on.now.before.tools.get(tool), state.tools.get(tool)
                if tool in self._on.plant.touched or self._on.plant.same(before, holds):
                    continue
                entries = {kind for kind, _ in self._on.books.verdicts(self._on.now.entries, tool)}
                self._on.hold(
                    "TakenBack",
                    bool(entries & _TRIED),
                    f"tool {tool} keeps {holds}, and nobody tried to put {before} back",
                )

    def _foreign(self) -> set[int]:
        """Return the tools that somebody else may have written since."""
        others = {tool for tool, _ in self._on.now.typed_by_others}
        others |= self._on.now.settled_by_others
        return self._on.plant.touched | others | ({OTHERS_TOOL} if self._on.now.crowded else set())

    def _succeeded(self, process: VirtualProcess, state: MachineState) -> None:
        self._on.hold(
            "NoSuccessAfterStop",
            process.stopped_ns is None,
            "it ends well although a stop was acknowledged",
        )
        wish, mine = self._on.now.wish, not self._on.plant.moved_itself
        if wish.selects is not None and mine and not self._on.now.crowded:
            self._on.hold(
                "StateIsTold",
                state.selected == wish.selects,
                f"tool {wish.selects} was to be selected, it is {state.selected}",
            )
        for tool, offset in wish.typed:
            self._on.hold(
                "StateIsTold",
                tool in self._foreign() or self._on.plant.same(state.tools.get(tool), offset),
                f"tool {tool} was to hold {offset}, it holds {state.tools.get(tool)}",
            )
        report = self._on.now.report
        if report is not None:
            self._certified(report, state)

    def _certified(self, report: ChangeReport, state: MachineState) -> None:
        (done,) = report.tools
        truth, found = self._on.plant.tip_of(TOOL), done.proposal.offset
        assert truth is not None  # for the type: it was measured
        error_mm = math.hypot(found.x_mm - truth.x_mm, found.y_mm - truth.y_mm)
        self._on.hold(
            "StateIsTold",
            TOOL in self._foreign() or self._on.plant.same(state.tools.get(TOOL), found),
            f"tool {TOOL} was proved as {found}, it holds {state.tools.get(TOOL)}",
        )
        habit = self._on.now.hour.habit
        self._on.hold(
            "NoProofWithoutTouch",
            habit.stays_share < 1.0,
            "a tip was proved that nobody brought onto the pin",
        )
        if habit.careful or habit.declines:
            within_mm = done.proposal.result.repeatable_to_mm or 0.1
            self._on.story.certified.append(error_mm <= within_mm)
            self._on.hold(
                "TipIsWhereItSays",
                error_mm <= SURELY_MM,
                f"the tip is {error_mm:.3f} mm from where it was proved to be",
            )

    def _told(self, error: BaseException | None, code: int, state: MachineState) -> None:
        """Check the report's statements about the controller."""
        if error is None:
            return
        outcome = outcome_after(error)
        foreign = self._foreign()
        for tool, stands in outcome.tools.items():
            if not stands.known or tool in foreign:
                continue
            holds = None if stands.holds is None else ToolOffset(*stands.holds)
            # Only registers can be read; a person was told that these may be waiting.
            waits = tool in self._on.doubted and self._on.from_a_lost_write(tool, holds)
            self._on.hold(
                "StateIsTold",
                waits or self._on.plant.same(holds, state.tools.get(tool)),
                f"tool {tool} is told to hold {holds}, it holds {state.tools.get(tool)}",
            )
        changed = [
            tool
            for tool in {*self._on.now.before.tools, *state.tools}
            if not self._on.plant.same(self._on.now.before.tools.get(tool), state.tools.get(tool))
        ]
        for tool in changed:
            self._on.hold(
                "StateIsTold",
                tool in foreign
                or tool in outcome.tools
                or code == UNKNOWN
                or self._on.came_from_a_lost_write(tool, state.tools.get(tool)),
                f"tool {tool} has changed, which {type(error).__name__} does not say",
            )
        selected = outcome.selected
        moved = (
            self._on.plant.moved_itself or self._on.now.crowded or bool(self._on.now.chosen_by_hand)
        )
        if outcome.selection_known and selected is not None and not moved:
            self._on.hold(
                "StateIsTold",
                selected == state.selected,
                f"tool {selected} is told to be selected, it is {state.selected}",
            )
        if outcome.effect is Effect.UNCHANGED and not moved:
            self._on.hold(
                "StateIsTold",
                state.selected == self._on.now.before.selected or bool(self._on.open_selection()),
                f"unchanged is told, but tool {state.selected} is selected",
            )


_PROOFS: Final = ("verified", "tested, and kept by the program")
"""The record's words for a tested value: by robolink, and by a program's touches."""

_DOUBT: Final = re.compile(r"for tool (\d+); on record is ")
"""Part of one of robolink's sentences (docs/plc-maps.md)."""


class RestRules:
    """Checks machine and journal while nothing is under way.

    Args:
        grounds: The data of the rules.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._by_others: dict[int, ToolOffset | None] = {}

    def said(self, text: str) -> None:
        """Note the tools whose registers a person was told are not recorded."""
        self._on.doubted |= {int(tool) for tool in _DOUBT.findall(text)}

    def left(self, state: MachineState) -> None:
        """Check the leftovers of a deed, however it ended, killed or not, before anybody acts."""
        # A stopped program leaves the tool that it had selected; it begins with its own tool again.
        own = self._on.plant.moved_itself or self._on.plant.calls_back
        if state.selected != self._on.now.before.selected and not own:
            self._on.hold(
                "SameToolSelected",
                bool(self._on.open_selection())
                or state.selected == self._on.now.wish.selects
                or state.selected in self._on.now.chosen_by_hand
                or selects(self._on.now.hour.line)
                or not self._on.books.readable(),  # the people are told that, and asked
                f"tool {state.selected} is selected in place of "
                f"{self._on.now.before.selected}, and nothing on record says so",
            )
        self._note_what_others_changed(state)
        if not self._on.books.trusted:
            return
        markers = self._on.books.markers()
        self._all_or_none(state, markers)
        for tool in {*self._on.now.before.tools, *state.tools}:
            holds = state.tools.get(tool)
            named = [
                m
                for m in markers
                if m.details.get("tool") == tool or str(tool) in m.details.get("tools", {})
            ]
            self._agrees(tool, holds, named)

    def _all_or_none(self, state: MachineState, markers: Sequence[BookedMarker]) -> None:
        """Check that of several tools all hold the typed values, or none: or something is open."""
        typed = self._on.now.wish.typed
        others = self._on.plant.touched | {tool for tool, _ in self._on.now.typed_by_others}
        if len(typed) < 2 or markers or any(tool in others for tool, _ in typed):
            return
        new = [self._on.plant.same(state.tools.get(tool), offset) for tool, offset in typed]
        held = {tool: state.tools.get(tool) for tool, _ in typed}
        self._on.hold("AllOrNone", all(new) or not any(new), f"half of {typed} stands: {held}")

    def _note_what_others_changed(self, state: MachineState) -> None:
        """Note values that no journal can know, until they are written again.

        A hand at the pendant wrote them, or the disk has lost data that it reported as kept.
        """
        for tool in {*self._on.now.first.tools, *state.tools}:
            if tool in self._on.plant.touched or not self._on.books.trusted:
                self._by_others[tool] = state.tools.get(tool)
        if not self._on.books.trusted:
            self._on.staged |= self._on.plant.staged()

    def _agrees(self, tool: int, holds: ToolOffset | None, named: Sequence[BookedMarker]) -> None:
        known, value = self._on.books.value_of(tool)
        if tool in self._by_others and self._on.plant.same(self._by_others[tool], holds):
            return
        if tool in self._on.plant.touched or named or self._on.came_from_a_lost_write(tool, holds):
            return
        self._on.hold(
            "BooksAgree",
            not known or self._on.plant.same(value, holds),
            f"tool {tool} is on record as {value}, it holds {holds}, and nothing is open",
        )
        wanted = [*self._on.now.wanted.get(tool, [None]), *self._on.plant.values]
        self._on.hold(
            "OnlyWantedValues",
            any(self._on.plant.same(one, holds) for one in wanted),
            f"tool {tool} holds {holds}, which nobody wanted: {wanted}",
        )

    def at_rest(self, state: MachineState, *, usable: bool, why: str) -> None:
        """Check the cell after its people have recovered it."""
        self._on.hold("UsableAgain", usable, f"nobody gets it going again: {why}")
        if not usable:
            return
        self._on.hold(
            "SameToolSelected", state.selected == TOOL, f"tool {state.selected} is selected"
        )
        begun = self._on.plant.movements - self._on.now.movements
        self._on.hold(
            "MovesOnce",
            begun <= len(self._on.now.moves) or not self._on.books.trusted,
            f"{begun} movements were begun under {len(self._on.now.moves)} markers",
        )
        self._note_what_others_changed(state)
        if not self._on.books.trusted:
            return
        for tool in {*self._on.now.first.tools, *state.tools}:
            holds, before = state.tools.get(tool), self._on.now.first.tools.get(tool)
            self._agrees(tool, holds, ())
            if tool in self._on.plant.touched or self._on.plant.same(holds, before):
                continue
            if self._on.came_from_a_lost_write(tool, holds):
                continue
            self._on.hold("KeptOnProof", self._proved(tool, holds), f"tool {tool} keeps {holds}")
            if self._on.plant.calls_back and holds is not None:
                self._certified_by_program(holds)

    def _certified_by_program(self, kept: ToolOffset) -> None:
        """Compare a value that the machine's own program keeps with the tip's place."""
        truth = self._on.plant.tip_of(TOOL)
        if truth is None:
            return
        error_mm = math.hypot(kept.x_mm - truth.x_mm, kept.y_mm - truth.y_mm)
        self._on.story.certified.append(error_mm <= TOLERANCE_MM)
        self._on.hold(
            "TipIsWhereItSays",
            error_mm <= SURELY_MM,
            f"the tip is {error_mm:.3f} mm from where the program was told that it is",
        )

    def _proved(self, tool: int, holds: ToolOffset | None) -> bool:
        """Return whether a new value rests on a test, or on a person's confirmation."""
        typed = (*self._on.now.wish.asked, *self._on.now.typed_by_others)
        if any(n == tool and self._on.plant.same(offset, holds) for n, offset in typed):
            return True
        wish = self._on.now.wish
        if wish.undoes or wish.free or self._on.now.hour.habit.keeps:
            return True
        verdicts = self._on.books.verdicts(self._on.now.entries, tool)
        return any(kind == "done" and verdict in _PROOFS for kind, verdict in verdicts)
