"""The adversary's view of a machine in a virtual cell, whatever its kind."""

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
"""Half of the last of three decimals, with room for rounding: mm and degrees."""

USUAL_TOOL: Final = ToolOffset(4.5, -0.75, -9.25)
"""The value of tool 2 before anybody has typed one."""

HANDS_VALUES: Final = (ToolOffset(13.257, -4.125, -21.503), ToolOffset(11.406, -2.871, -19.642))
"""Values typed at the machine's own panel; the one that differs from the stored value is used."""


class SentKind(StrEnum):
    """The effect of a request on the machine."""

    MOVE = "move"
    WRITE = "write"
    SELECT = "select"
    STOP = "stop"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class SentRequest:
    """A request as it leaves a process.

    Attributes:
        kind: Its effect.
        text: The request as sent, or in words.
        tool: The tool, if it is about one.
        forbidden: Why it must not leave over this link, empty if it may.
    """

    kind: SentKind
    text: str
    tool: int | None = None
    forbidden: str = ""


@dataclass(frozen=True, slots=True)
class MachineState:
    """The stored state of a machine.

    Attributes:
        tools: Every defined tool.
        selected: The selected tool, 0 for none.
        settings: Power and speeds that a procedure has to restore, if there are any.
        robot: The current robot, if a controller has several.
    """

    tools: Mapping[int, ToolOffset]
    selected: int
    settings: tuple[float, ...] = ()
    robot: int = 1


class WireTap(Protocol):
    """Receives all wire traffic."""

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Handle a request before it leaves.

        Raises:
            Killed: The process is dead, so nothing leaves.
        """

    def given(self, tool: int, value: ToolOffset) -> None:
        """Handle a value that the machine's own program is about to get."""

    def passed(self, process: VirtualProcess, text: str) -> None:
        """Handle a request or an answer that has passed; may kill the process."""


class PlantMachine(ABC):
    """A simulated controller with its world.

    Args:
        clock: The virtual time.
        tap: Receives all wire traffic.

    Attributes:
        moved_by_robolink: Whether robolink moves it, resets it and selects its tools.
        password: Its remote password; empty without one.
        calls_back: Whether its own program changes the tool, and calls robolink back.
        numbered: Whether its commands have numbers, so that a repeated one counts once.
        touched: Tools that somebody has written since the last check, not through this computer.
        by_hand: Their last values, by tool.
        moved_itself: Whether the selected tool was changed since then, not through this computer.
        acts: Events planned outside the wire, counted by requests.
        values: Values given to its own program since the last check.
        settings_reset: Whether the machine has reset power and speeds to its own since then.
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
        """Whether the wire had a fault in this deed, so that answers may be wrong."""
        return bool(self.simulator.faults.fired)

    @property
    def eyes(self) -> InProcessEyes | None:
        """The view of the person at the machine; ``None`` if robolink moves nothing."""
        return None

    def tip_of(self, tool: int) -> ToolOffset | None:  # the form of those that know
        """Return the real place of a tool's tip, as far as the machine has a world."""
        return None

    @abstractmethod
    def prepare(self, person: WorldParameters) -> None:
        """Let a person begin an hour, with another nozzle if the machine has a world."""

    def carry_out(self, controller: Controller, hour: Hour, tell: Tell) -> ChangeReport | None:
        """Carry out the deed of an hour; return the report if a tip was measured.

        Raises:
            RobolinkError: It did not succeed.
        """
        return carry_out(controller, hour, self.eyes, tell)

    def put_right(self, controller: Controller, habit: Habit, tell: Tell) -> bool:
        """Recover as a person does after an accident; return whether nothing is left.

        Raises:
            RobolinkError: It does not work yet.
        """
        return put_right(controller, habit, tell, moved_by_robolink=self.moved_by_robolink)

    def advance(self) -> None:
        """Advance the machine to the present time."""
        self.simulator.advance(self.clock.now_ns())

    @abstractmethod
    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Connect a process to it.

        Raises:
            RobolinkError: The connection failed.
        """

    def openings(self, process: VirtualProcess) -> Mapping[str, Callable[..., object]]:  # as above
        """Return the openers, by dotted name, of links that need no record.

        A stop and a reading of its effect open a link of their own. They get the watched wire.
        """
        return {}

    def shown(self, tool: int) -> ToolOffset | None:
        """Return the displayed value of a tool, which may be written and not yet in use."""
        return self.state().tools.get(tool)

    @abstractmethod
    def hang_up(self, process: VirtualProcess) -> None:
        """Close everything that a dead process had open."""

    @abstractmethod
    def state(self) -> MachineState:
        """Return the present stored state."""

    def mistook(self, asked: ToolOffset, held: ToolOffset) -> bool:  # as above
        """Return whether it mistook an offset for the one that it holds."""
        return False

    def staged(self) -> Mapping[int, ToolOffset]:
        """Return values that robolink can read and that are not yet in use."""
        return {}

    @property
    @abstractmethod
    def moving(self) -> bool:
        """Whether something moves."""

    def flange(self) -> Frame | None:
        """Return the flange pose, ``None`` if robolink moves nothing."""
        return None

    def tip(self) -> Frame | None:
        """Return the pose of the selected tool's tip, ``None`` if robolink moves nothing."""
        return None

    @property
    @abstractmethod
    def movements(self) -> int:
        """The number of movements begun so far."""

    @abstractmethod
    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the wire or of the machine."""

    @abstractmethod
    def disarm(self) -> int:
        """Drop the plans that did not occur; return how many did."""

    def note_hand(self, tool: int, offset: ToolOffset) -> None:
        """Note that somebody has written a tool, not through this computer."""
        self.touched.add(tool)
        self.by_hand[tool] = offset

    @abstractmethod
    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Let somebody write a tool at the machine's own panel."""

    def type_by_hand(self, tool: int) -> ToolOffset:
        """Let somebody type another value there; return the value then stored."""
        held = self.state().tools.get(tool)
        self.write_by_hand(tool, next(one for one in HANDS_VALUES if not self.same(one, held)))
        return self.state().tools[tool]

    def choose_by_hand(self, which: int) -> int | None:
        """Let somebody select another tool there; return it, ``None`` without another."""
        state = self.state()
        others = sorted({*state.tools} - {state.selected})
        if not others:
            return None
        tool = others[which % len(others)]
        self.select_by_hand(tool)
        return tool

    @abstractmethod
    def select_by_hand(self, tool: int) -> None:
        """Let somebody select a tool at the machine's own panel."""

    @abstractmethod
    def repair(self) -> None:
        """Let a person operate the machine's buttons, doors and switches as needed."""

    def same(self, one: ToolOffset | None, other: ToolOffset | None) -> bool:
        """Whether it stores two offsets as the same value."""
        if one is None or other is None:
            return one is other
        pairs = zip(one.components(), other.components(), strict=True)
        return all(abs(a - b) <= _ALIKE for a, b in pairs)

    def holds(self, asked: ToolOffset | None, held: ToolOffset | None) -> bool:
        """Whether it holds the requested value with every digit that it can store."""
        if asked is None or held is None:
            return asked is held
        pairs = zip(asked.components(), held.components(), strict=True)
        return all(abs(a - b) <= self.finest(a) for a, b in pairs)

    def finest(self, value: float) -> float:  # the form of those that round
        """Return the tolerance of a stored number; three decimals are printed."""
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
