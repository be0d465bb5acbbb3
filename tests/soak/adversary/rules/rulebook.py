"""All rules of one cell."""

from robolink.model import Finding, MarkerKind, ToolOffset
from tests.soak.adversary.books import Books
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import Hour, Story
from tests.soak.adversary.people import Wish
from tests.soak.adversary.plant.machine import (
    MachineState,
    PlantMachine,
    SentKind,
    SentRequest,
)
from tests.soak.adversary.rules.contract import ContractRules
from tests.soak.adversary.rules.deed_end import EndRules, RestRules
from tests.soak.adversary.rules.grounds import Grounds, HourSoFar
from tests.soak.adversary.rules.kept_values import AskedRules, BeforeRules, HandRules
from tests.soak.adversary.rules.on_wire import WireRules

Typed = tuple[int, ToolOffset]
"""A tool, and the offset typed for it."""


class Rulebook(Grounds):
    """Checks the rules of one cell.

    Args:
        story: Receives broken rules.
        plant: The machine.
        books: The journal on the disk.

    Attributes:
        contract: The rules for every call.

    Example:
        >>> from pathlib import Path
        >>> from robolink.model import ToolOffset
        >>> from robolink_simulators.cell.clock import ManualClock
        >>> from tests.soak.adversary import drawn_history
        >>> from tests.soak.adversary.books import Books
        >>> from tests.soak.adversary.cell import VirtualCell
        >>> from tests.soak.adversary.people import wish_of
        >>> from tests.soak.adversary.plant.epson import EpsonPlant
        >>> from tests.soak.adversary.rules import Rulebook
        >>> history, books = drawn_history(23, hours=2), Books(Path("journal.db"))
        >>> typing = history.hours[1]  # somebody types an offset of tool 2
        >>> cell = VirtualCell(history, Path("disk"))
        >>> plant = EpsonPlant(ManualClock(), cell, seed=23)
        >>> rules = Rulebook(cell.story, plant, books)
        >>> rules.begin(typing, wish_of(typing))
        >>> rules.left(plant.state())  # nothing was written, and nothing is on record
        >>> cell.story.broken
        []
        >>> plant.simulator.machine.tools.set(2, ToolOffset(9.0, 9.0))
        >>> rules.left(plant.state())
        >>> cell.story.broken[0].rule
        'ContractHolds'
    """

    def __init__(self, story: Story, plant: PlantMachine, books: Books) -> None:
        super().__init__(story, plant, books)
        self._on_wire, self._at_end, self._at_rest = (
            WireRules(self),
            EndRules(self),
            RestRules(self),
        )
        self._asked, self._by_hand, self._before = (
            AskedRules(self),
            HandRules(self),
            BeforeRules(self),
        )
        self.contract = ContractRules(self)

    def begin(self, hour: Hour, wish: Wish) -> None:
        """Begin an hour."""
        state = self.plant.state()
        self.now = HourSoFar(
            hour,
            wish,
            state,
            state,
            self.books.last_number(),
            frozenset(marker.operation for marker in self.books.markers()),
            self.plant.movements,
            state,
        )
        for tool, offset in state.tools.items():
            self.now.wanted[tool] = [offset]
        self.plant.touched.clear()
        self.plant.by_hand.clear()
        self.plant.values.clear()
        self.plant.moved_itself = self.plant.settings_reset = False
        self._asked.begin()
        self._by_hand.begin()
        self.contract.begin(state, previews="--dry-run" in hour.line)

    def begin_again(self) -> None:
        """Begin another try in the same hour; all open markers count as old."""
        self.now.before = self.plant.state()
        self.now.old_markers = frozenset(m.operation for m in self.books.markers())
        self.now.report = None
        self._asked.doubt()
        self._by_hand.begin()

    def hand_typed(self, tool: int, offset: ToolOffset) -> None:
        """Note a value that somebody types at the machine while robolink asks a question."""
        self._by_hand.typed(tool, offset)

    def hand_chose(self, tool: int) -> None:
        """Note a tool that somebody selects at the machine meanwhile."""
        self.now.chosen_by_hand.append(tool)

    def agreed(self) -> None:
        """Note the machine's state while a person agrees to a change of it."""
        self.now.agreed = self.plant.state()

    def said(self, text: str) -> None:
        """Note a message to a person."""
        self._at_rest.said(text)

    def word_on(self, finding: Finding) -> bool:
        """Note that somebody was shown a finding and has looked; return their answer."""
        if finding.marker.kind is MarkerKind.HISTORY:
            self.books.lost = False
        return True

    def others_settle(self) -> None:
        """Note that a second person is about to recover open jobs, whoever left them."""
        self.now.crowded = True
        for marker in self.books.markers():
            named = (marker.details.get("tool"), *marker.details.get("tools", {}))
            self.now.settled_by_others |= {int(tool) for tool in named if tool is not None}
        if not self.books.trusted:
            self.now.settled_by_others |= {*self.plant.state().tools}

    def others_write(self, process: VirtualProcess, typed: Typed) -> None:
        """Note that a second person has read a tool, and writes it."""
        tool, offset = typed
        self._by_hand.replaces(process, tool, offset)
        self.now.crowded = True
        self.now.typed_by_others.append((tool, offset))
        self.now.wanted.setdefault(tool, [None]).append(offset)

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave a process."""
        self._on_wire.leaving(process, sent)
        self.contract.leaving(process, sent)
        if sent.kind not in (SentKind.OTHER, SentKind.STOP):
            self._before.leaving(process, sent)
            self._by_hand.leaving(process, sent, self.plant.state())

    def given(self, tool: int, value: ToolOffset) -> None:
        """Check a value before the machine's own program gets it."""
        self._on_wire.given(tool, value)

    def stopped(self) -> None:
        """Check the machine when a stop from outside the driver is acknowledged."""
        self.contract.stops.acknowledged()

    def ended(
        self, process: VirtualProcess, error: BaseException | None, state: MachineState
    ) -> None:
        """Check the reported end of a deed against the machine's present state.

        Args:
            process: The process of the deed.
            error: The error that ended it, ``None`` for none.
            state: The machine's present state.

        Example:
            >>> from pathlib import Path
            >>> from robolink.journal import LeaseHolder
            >>> from robolink_simulators.cell.clock import ManualClock
            >>> from tests.soak.adversary import drawn_history
            >>> from tests.soak.adversary.books import Books
            >>> from tests.soak.adversary.cell import VirtualCell
            >>> from tests.soak.adversary.computer import VirtualProcess
            >>> from tests.soak.adversary.people import wish_of
            >>> from tests.soak.adversary.plant.epson import EpsonPlant
            >>> from tests.soak.adversary.rules import Rulebook
            >>> history, books = drawn_history(23, hours=2), Books(Path("journal.db"))
            >>> typing = history.hours[1]  # somebody types an offset of tool 2
            >>> cell = VirtualCell(history, Path("disk"))
            >>> plant = EpsonPlant(ManualClock(), cell, seed=23)
            >>> rules = Rulebook(cell.story, plant, books)
            >>> rules.begin(typing, wish_of(typing))
            >>> process = VirtualProcess(101, "anna", LeaseHolder(), Path("journal.db"))
            >>> rules.ended(process, None, plant.state())  # well, it says, and tool 2 holds nothing
            >>> cell.story.broken[0].rule
            'StateIsTold'
        """
        self._at_end.ended(process, error, state)
        self._before.ended(process, error)
        if error is None:
            self._asked.succeeded(self.now.wish, state)
        else:
            self._asked.doubt()

    def killed(self) -> None:
        """Note that a deed did not end by itself."""
        self._asked.doubt()

    def left(self, state: MachineState) -> None:
        """Check the leftovers of a deed before anybody acts."""
        self.contract.left()
        self._at_rest.left(state)
        self._before.left(state)
        self._asked.left(state)

    def at_rest(self, state: MachineState, *, usable: bool, why: str) -> None:
        """Check the cell after its people have recovered it.

        Args:
            state: The machine's present state.
            usable: Whether they got it going again.
            why: The reason if not; empty if they did.

        Example:
            >>> from pathlib import Path
            >>> from robolink_simulators.cell.clock import ManualClock
            >>> from tests.soak.adversary import drawn_history
            >>> from tests.soak.adversary.books import Books
            >>> from tests.soak.adversary.cell import VirtualCell
            >>> from tests.soak.adversary.people import wish_of
            >>> from tests.soak.adversary.plant.epson import EpsonPlant
            >>> from tests.soak.adversary.rules import Rulebook
            >>> history, books = drawn_history(23, hours=2), Books(Path("journal.db"))
            >>> typing = history.hours[1]  # somebody types an offset of tool 2
            >>> cell = VirtualCell(history, Path("disk"))
            >>> plant = EpsonPlant(ManualClock(), cell, seed=23)
            >>> rules = Rulebook(cell.story, plant, books)
            >>> rules.begin(typing, wish_of(typing))
            >>> rules.at_rest(plant.state(), usable=False, why="the guard is open")
            >>> cell.story.broken[0].rule
            'UsableAgain'
        """
        self._at_rest.at_rest(state, usable=usable, why=why)
        if usable:
            self._before.at_rest(state)
            self._by_hand.at_rest(state)
        else:
            self._asked.doubt()
        self._asked.at_rest(state)
