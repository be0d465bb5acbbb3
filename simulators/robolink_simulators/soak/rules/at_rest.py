"""What is left behind: before anybody acts, and when the people have put it right."""

import math
import re
from collections.abc import Sequence
from typing import Final

from robolink.model import ToolOffset
from robolink_simulators.soak.books import BookedMarker
from robolink_simulators.soak.people import TOOL
from robolink_simulators.soak.plant.machine import MachineState
from robolink_simulators.soak.rules.so_far import SURELY_MM, TOLERANCE_MM, Grounds
from robolink_simulators.soak.typed_lines import selects

_PROOFS: Final = ("verified", "proved, and kept by the program")
"""What the record says of a value that was proved: by robolink, and by a program's touches."""

_DOUBT: Final = re.compile(r"The registers of tool (\d+) hold ")
"""The beginning of a sentence of robolink's (docs/plc-maps.md)."""


class RestRules:
    """Looks at machine and journal while nothing is under way.

    Args:
        grounds: What the rules rest on.
    """

    def __init__(self, grounds: Grounds) -> None:
        self._on = grounds
        self._by_others: dict[int, ToolOffset | None] = {}
        self._staged: dict[int, ToolOffset] = {}
        self._told: set[int] = set()

    def said(self, text: str) -> None:
        """Note what a person was told: of which tools the registers are not on record."""
        self._told |= {int(tool) for tool in _DOUBT.findall(text)}

    def left(self, state: MachineState) -> None:
        """Check what a deed left behind, however it ended, killed or not, before anybody acts."""
        # A program that is stopped leaves what it had selected; it begins with its own tool again.
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
        """Check that of several tools all hold what was typed, or none: or something is open."""
        typed = self._on.now.wish.typed
        others = self._on.plant.touched | {tool for tool, _ in self._on.now.typed_by_others}
        if len(typed) < 2 or markers or any(tool in others for tool, _ in typed):
            return
        new = [self._on.plant.same(state.tools.get(tool), offset) for tool, offset in typed]
        held = {tool: state.tools.get(tool) for tool, _ in typed}
        self._on.hold("AllOrNone", all(new) or not any(new), f"half of {typed} stands: {held}")

    def _note_what_others_changed(self, state: MachineState) -> None:
        """Note values that no journal can be right about, until they are written again.

        A hand at the pendant wrote them, or the disk has lost what it said that it had kept.
        """
        for tool in {*self._on.now.first.tools, *state.tools}:
            if tool in self._on.plant.touched or not self._on.books.trusted:
                self._by_others[tool] = state.tools.get(tool)
        if not self._on.books.trusted:
            self._staged |= self._on.plant.staged()

    def _came_from_a_lost_write(self, tool: int, holds: ToolOffset | None) -> bool:
        """Tell whether a request brought into force what nobody could know to wait for one.

        A write had ended between its registers and its request, and the disk lost the record of
        it. A person has to have been told, where the record could show it.
        """
        staged = self._staged.get(tool)
        known, _ = self._on.books.value_of(tool)
        if staged is None or not self._on.plant.same(staged, holds):
            return False
        return tool in self._told or not known

    def _agrees(self, tool: int, holds: ToolOffset | None, named: Sequence[BookedMarker]) -> None:
        known, value = self._on.books.value_of(tool)
        if tool in self._by_others and self._on.plant.same(self._by_others[tool], holds):
            return
        if tool in self._on.plant.touched or named or self._came_from_a_lost_write(tool, holds):
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
        """Check the cell after its people have put it right."""
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
            if self._came_from_a_lost_write(tool, holds):
                continue
            self._on.hold("KeptOnProof", self._proved(tool, holds), f"tool {tool} keeps {holds}")
            if self._on.plant.calls_back and holds is not None:
                self._certified_by_program(holds)

    def _certified_by_program(self, kept: ToolOffset) -> None:
        """Compare a value that the machine's own program keeps with where the tip is."""
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
        """Tell whether a new value rests on a proof, or on a person's word."""
        typed = (*self._on.now.wish.asked, *self._on.now.typed_by_others)
        if any(n == tool and self._on.plant.same(offset, holds) for n, offset in typed):
            return True
        wish = self._on.now.wish
        if wish.undoes or wish.free or self._on.now.hour.habit.keeps:
            return True
        verdicts = self._on.books.verdicts(self._on.now.entries, tool)
        return any(kind == "done" and verdict in _PROOFS for kind, verdict in verdicts)
