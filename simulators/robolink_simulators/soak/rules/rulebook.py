"""All rules of one cell."""

from robolink.model import ToolOffset
from robolink_simulators.soak.books import Books
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Hour
from robolink_simulators.soak.people import Wish
from robolink_simulators.soak.plant.machine import MachineState, PlantMachine, SentRequest
from robolink_simulators.soak.rules.at_end import EndRules
from robolink_simulators.soak.rules.at_rest import RestRules
from robolink_simulators.soak.rules.on_wire import WireRules
from robolink_simulators.soak.rules.so_far import Grounds, HourSoFar
from robolink_simulators.soak.story import Story


class Rulebook(Grounds):
    """Checks the rules of one cell; made from what :class:`Grounds` is made from."""

    def __init__(self, story: Story, plant: PlantMachine, books: Books) -> None:
        super().__init__(story, plant, books)
        self._on_wire, self._at_end, self._at_rest = (
            WireRules(self),
            EndRules(self),
            RestRules(self),
        )

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
        )
        for tool, offset in state.tools.items():
            self.now.wanted[tool] = [offset]
        self.plant.touched.clear()
        self.plant.by_hand.clear()
        self.plant.values.clear()
        self.plant.moved_itself = False

    def begin_again(self) -> None:
        """Begin another try in the same hour; what is open by now is of before."""
        self.now.before = self.plant.state()
        self.now.old_markers = frozenset(m.operation for m in self.books.markers())
        self.now.report = None

    def others_write(self, tool: int, offset: ToolOffset) -> None:
        """Note that a second person writes a tool."""
        self.now.crowded = True
        self.now.typed_by_others.append((tool, offset))
        self.now.wanted.setdefault(tool, [None]).append(offset)

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Check a request that is about to leave a process."""
        self._on_wire.leaving(process, sent)

    def given(self, tool: int, value: ToolOffset) -> None:
        """Check a value before the machine's own program is given it."""
        self._on_wire.given(tool, value)

    def stopped(self) -> None:
        """Check the machine at the moment in which a stop is acknowledged."""
        self._on_wire.stopped()

    def ended(
        self, process: VirtualProcess, error: BaseException | None, state: MachineState
    ) -> None:
        """Check how a deed ended, against what the machine keeps now."""
        self._at_end.ended(process, error, state)

    def left(self, state: MachineState) -> None:
        """Check what a deed left behind, before anybody acts."""
        self._at_rest.left(state)

    def at_rest(self, state: MachineState, *, usable: bool, why: str) -> None:
        """Check the cell after its people have put it right."""
        self._at_rest.at_rest(state, usable=usable, why=why)
