"""What happens to a cell, hour by hour: drawn from a seed, plain data, cut shorter at will.

Each hour draws from the seed and its own number, so an hour, or one of its disturbances, can be
left out and all others stay as they were.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Self


class CellKind(StrEnum):
    """What stands in the cell."""

    EPSON = "epson"
    SOFTMOTION = "softmotion"
    EPSON_SERIAL = "epson over rs232"
    MODBUS_TCP = "softmotion over modbus tcp"
    MODBUS_RTU = "softmotion over modbus rtu"
    CANOPEN = "softmotion over canopen"
    REGISTER_MAP = "plc with a register map"
    PROGRAM = "epson program that calls back"


class Deed(StrEnum):
    """What somebody sets out to do."""

    CHANGE_NOZZLE = "change the nozzle"
    SET_TOOL = "type a tool offset"
    SET_TWO = "type two tool offsets"
    SELECT_TOOL = "select a tool"
    UNDO = "undo the last change"
    PRODUCE = "let production measure and change its needle"
    SET_THEN_UNDO = "type an offset twice, and take the last one back"
    MOVE_AND_LEAVE = "begin a movement and leave"
    COMMAND = "type a command"


class Hindrance(StrEnum):
    """What kind of thing gets in the way."""

    WIRE = "wire"
    LINE = "line"
    MACHINE = "machine"
    STOP = "stop"
    KILL = "kill"
    POWER_CUT = "power cut"
    PENDANT = "pendant"
    PRODUCTION = "production"
    SECOND_PERSON = "second person"
    DISK = "disk"
    CLOCK = "clock"
    INTERRUPT = "interrupt"
    ANOTHER_CLIENT = "another client"
    HAND = "hand"
    FREEZE = "freeze"


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One thing that gets in the way, once.

    Attributes:
        kind: What kind of thing.
        what: Which of its kind: the name of a wire fault, of an act at the panel ...
        match: Text that a request, or a checkpoint, must contain to be counted; empty counts all.
        at: Which of those that are counted, from 0.
        seconds: A delay in virtual time, where it has one.
        position: A byte or word of an answer; ``None`` for its middle.
    """

    kind: Hindrance
    what: str = ""
    match: str = ""
    at: int = 0
    seconds: float = 0.0
    position: int | None = None

    def __str__(self) -> str:
        where = f" at number {self.at}" + (f" of {self.match!r}" if self.match else "")
        late = f", {self.seconds:g} s" if self.seconds else ""
        return f"{self.kind} {self.what}".rstrip() + where + late


@dataclass(frozen=True, slots=True)
class Habit:
    """How the person of an hour works.

    Attributes:
        person: Their badge.
        stays_share: Share of the touches for which they only press ENTER.
        types_ahead: They press ENTER before they are asked.
        bias_mm: How far beside the pin they always stop.
        tires_mm: By how much their aim wanders from touch to touch.
        declines: They say no to the proposal.
        keeps: After an accident they keep what nobody verified.
        impatient: After an accident they try again before they recover anything.
    """

    person: str = "anna"
    stays_share: float = 0.0
    types_ahead: bool = False
    bias_mm: float = 0.0
    tires_mm: float = 0.0
    declines: bool = False
    keeps: bool = False
    impatient: bool = False

    @property
    def careful(self) -> bool:
        """Whether each touch is made as it should be."""
        return not (self.stays_share or self.types_ahead or self.bias_mm or self.tires_mm)


@dataclass(frozen=True, slots=True)
class Hour:
    """One hour of a cell.

    Attributes:
        number: Which one, from 0; what is drawn in it hangs on this.
        deed: What is set out to do.
        habit: Who does it, and how.
        disturbances: What gets in the way.
        line: What is typed where the deed is a command, without the program's name.
    """

    number: int
    deed: Deed
    habit: Habit
    disturbances: tuple[Disturbance, ...]
    line: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class History:
    """What happens to one cell.

    Attributes:
        seed: From which it was drawn, and from which all chance in it comes.
        kind: What stands in the cell.
        hours: Its hours; some may be left out.
    """

    seed: int
    kind: CellKind
    hours: tuple[Hour, ...]

    def without_hours(self, dropped: Sequence[int]) -> Self:
        """Return it without some hours, by number."""
        return replace(self, hours=tuple(h for h in self.hours if h.number not in dropped))

    @property
    def disturbances(self) -> int:
        """How many there are."""
        return sum(len(hour.disturbances) for hour in self.hours)
