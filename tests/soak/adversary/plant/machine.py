"""What a machine in a virtual cell is to the adversary, whatever its kind."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.calibration_run import ChangeReport
from robolink.model import Controller, OutcomeLog, ToolOffset
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import CountedActs, Disturbance, Habit, Hour
from tests.soak.adversary.people import Tell, carry_out, put_right

_ALIKE: Final = 0.0006
"""Half of the last of three decimals, and room for rounding: mm and degrees."""

USUAL_TOOL: Final = ToolOffset(4.5, -0.75, -9.25)
"""What tool 2 holds when nobody has typed anything yet."""

HANDS_VALUES: Final = (ToolOffset(13.257, -4.125, -21.503), ToolOffset(11.406, -2.871, -19.642))
"""What somebody types at the machine's own panel; the one that is not there yet."""


class SentKind(StrEnum):
    """What a request on the wire does to the machine."""

    MOVE = "move"
    WRITE = "write"
    SELECT = "select"
    STOP = "stop"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class SentRequest:
    """A request as it leaves a process.

    Attributes:
        kind: What it does.
        text: As it stands on the wire, or in words.
        tool: Which tool, where it is about one.
        forbidden: Why it must not leave over this link, empty where it may.
    """

    kind: SentKind
    text: str
    tool: int | None = None
    forbidden: str = ""


@dataclass(frozen=True, slots=True)
class MachineState:
    """What a machine keeps.

    Attributes:
        tools: Every tool that is defined.
        selected: The selected tool, 0 for none.
        settings: Power and speeds that a procedure has to leave as they were, where it has any.
        robot: The current robot, where a controller has several.
    """

    tools: Mapping[int, ToolOffset]
    selected: int
    settings: tuple[float, ...] = ()
    robot: int = 1


class WireTap(Protocol):
    """Who is told of all that crosses the wire."""

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """See a request before it leaves.

        Raises:
            Killed: The process is dead, so nothing leaves.
        """

    def given(self, tool: int, value: ToolOffset) -> None:
        """See a value that the machine's own program is about to be given."""

    def passed(self, process: VirtualProcess, text: str) -> None:
        """See that a request or an answer has passed; the process may be killed here."""


class PlantMachine(ABC):
    """A simulated controller with its world.

    Args:
        clock: The virtual time.
        tap: Told of everything on the wire.

    Attributes:
        moved_by_robolink: Whether robolink moves it, resets it and selects its tools.
        password: Its remote password; empty where it has none.
        calls_back: Whether its own program changes the tool, and calls robolink back.
        numbered: Whether its commands have numbers, so that one that comes twice counts once.
        touched: Tools that somebody past this computer has written since the last look.
        by_hand: What they wrote last, by tool.
        moved_itself: Whether the selected tool was changed past this computer since then.
        acts: What is planned to happen past the wire, counted by requests.
        values: Values that its own program was given since the last look.
        settings_reset: Whether the machine has put power and speeds to its own since then.
    """

    kind: str
    address: str
    password: str = ""
    moved_by_robolink: bool = True
    calls_back: bool = False
    numbered: bool = False

    def __init__(self, clock: ManualClock, tap: WireTap) -> None:
        self.clock = clock
        self.tap = tap
        self.touched: set[int] = set()
        self.by_hand: dict[int, ToolOffset] = {}
        self.moved_itself = False
        self.acts = CountedActs()
        self.values: list[ToolOffset] = []
        self.settings_reset = False

    @property
    @abstractmethod
    def simulator(self) -> EpsonSimulator | SoftMotionSimulator | PlcSimulator:
        """The simulated controller."""

    @property
    def bent(self) -> bool:
        """Whether something on the wire has gone wrong in this deed, so that answers may lie."""
        return bool(self.simulator.faults.fired)

    @property
    def eyes(self) -> InProcessEyes | None:
        """What the person at the machine sees with; ``None`` where robolink moves nothing."""
        return None

    def tip_of(self, tool: int) -> ToolOffset | None:  # the form of those that know
        """Return where a tool's tip really is, as far as the machine has a world."""
        return None

    @abstractmethod
    def prepare(self, person: WorldParameters) -> None:
        """Let a person begin an hour, with another nozzle where the machine has a world."""

    def carry_out(self, controller: Controller, hour: Hour, tell: Tell) -> ChangeReport | None:
        """Do what the person of an hour set out to do; a report where a tip was measured.

        Raises:
            RobolinkError: It did not succeed.
        """
        return carry_out(controller, hour, self.eyes, tell)

    def put_right(self, controller: Controller, habit: Habit, tell: Tell) -> bool:
        """Do what a person does after an accident; return whether nothing is left.

        Raises:
            RobolinkError: It does not work yet.
        """
        return put_right(controller, habit, tell, moved_by_robolink=self.moved_by_robolink)

    def advance(self) -> None:
        """Let the machine follow the time."""
        self.simulator.advance(self.clock.now_ns())

    @abstractmethod
    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Connect a process to it.

        Raises:
            RobolinkError: That fails.
        """

    def openings(self, process: VirtualProcess) -> Mapping[str, Callable[..., object]]:  # as above
        """Return what opens the wire for what needs no record, by dotted name.

        A stop and a look at what a controller does open it by themselves. They get the wire that is
        watched.
        """
        return {}

    def shown(self, tool: int) -> ToolOffset | None:
        """Return what it shows of a tool, which may be written already and not be in force."""
        return self.state().tools.get(tool)

    @abstractmethod
    def hang_up(self, process: VirtualProcess) -> None:
        """Close what a process that died had open."""

    @abstractmethod
    def state(self) -> MachineState:
        """Return what it keeps now."""

    def mistook(self, asked: ToolOffset, held: ToolOffset) -> bool:  # as above
        """Return whether it took an offset for the one that it holds."""
        return False

    def staged(self) -> Mapping[int, ToolOffset]:
        """Return values that stand where robolink reads them, and are not in force yet."""
        return {}

    @property
    @abstractmethod
    def moving(self) -> bool:
        """Whether something moves."""

    def flange(self) -> Frame | None:
        """Return where its flange is, ``None`` where robolink moves nothing."""
        return None

    def tip(self) -> Frame | None:
        """Return where the tip of the selected tool is, ``None`` where robolink moves nothing."""
        return None

    @property
    @abstractmethod
    def movements(self) -> int:
        """How many movements it has begun, ever."""

    @abstractmethod
    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the wire or of the machine."""

    @abstractmethod
    def disarm(self) -> int:
        """Forget what was planned and was not met; return how much was met."""

    def note_hand(self, tool: int, offset: ToolOffset) -> None:
        """Note that somebody past this computer has written a tool."""
        self.touched.add(tool)
        self.by_hand[tool] = offset

    @abstractmethod
    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Let somebody write a tool at the machine's own panel."""

    def type_by_hand(self, tool: int) -> ToolOffset:
        """Let somebody type another value there; return what the machine holds then."""
        held = self.state().tools.get(tool)
        self.write_by_hand(tool, next(one for one in HANDS_VALUES if not self.same(one, held)))
        return self.state().tools[tool]

    def choose_by_hand(self, which: int) -> int | None:
        """Let somebody put another tool in force there; return which, ``None`` without another."""
        state = self.state()
        others = sorted({*state.tools} - {state.selected})
        if not others:
            return None
        tool = others[which % len(others)]
        self.select_by_hand(tool)
        return tool

    @abstractmethod
    def select_by_hand(self, tool: int) -> None:
        """Let somebody put a tool in force at the machine's own panel."""

    @abstractmethod
    def repair(self) -> None:
        """Let a person at the machine do what is to be done there: buttons, doors, switches."""

    def same(self, one: ToolOffset | None, other: ToolOffset | None) -> bool:
        """Whether it stores two offsets alike."""
        if one is None or other is None:
            return one is other
        pairs = zip(one.components(), other.components(), strict=True)
        return all(abs(a - b) <= _ALIKE for a, b in pairs)

    def holds(self, asked: ToolOffset | None, held: ToolOffset | None) -> bool:
        """Whether it holds what was asked for, with every digit that it can hold."""
        if asked is None or held is None:
            return asked is held
        pairs = zip(asked.components(), held.components(), strict=True)
        return all(abs(a - b) <= self.finest(a) for a, b in pairs)

    def finest(self, value: float) -> float:  # the form of those that round
        """Return how far a number may be from the one asked for; three decimals are printed."""
        return 0.00051


class PlantWithWorld(PlantMachine):
    """A machine that robolink moves in a world with a pin, and a person at it."""

    @property
    @abstractmethod
    def simulator(self) -> EpsonSimulator | SoftMotionSimulator:
        """The simulated controller."""

    @property
    def eyes(self) -> InProcessEyes:
        """See :attr:`PlantMachine.eyes`."""
        return InProcessEyes(self.simulator)

    def tip_of(self, tool: int) -> ToolOffset:
        """See :meth:`PlantMachine.tip_of`."""
        return self.simulator.world.tips[tool]

    def prepare(self, person: WorldParameters) -> None:
        """See :meth:`PlantMachine.prepare`."""
        self.simulator.world.set_up(person)
        self.simulator.world.change_nozzle()
