"""What happens to a cell, hour by hour: drawn from a seed, plain data, cut shorter at will.

Each hour draws from the seed and its own number, so an hour, or one of its disturbances, can be
left out and all others stay as they were.
"""

import hashlib
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final, Self

from robolink.timing import NS_PER_S


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


_KEPT: Final = 4000
"""Events that are kept for the telling; the hash is over all."""


@dataclass(frozen=True, slots=True)
class RuleBroken:
    """A rule that did not hold.

    Attributes:
        rule: Its name.
        hour: In which hour.
        sentence: What was seen.
    """

    rule: str
    hour: int
    sentence: str

    def __str__(self) -> str:
        return f"{self.rule} in hour {self.hour}: {self.sentence}"


@dataclass(slots=True)
class Story:
    """One history as it went.

    Attributes:
        history: What was to happen.
        broken: Rules that did not hold, in order.
        events: How many events there were.
        hours: How many hours were run.
        endings: How the deeds ended, by name, and how often.
        met: Which disturbances were met, by kind, and how often.
        checks: How often each rule was looked at.
        certified: Tips that were proved, and how many of those lay where they were said to.
    """

    history: History
    broken: list[RuleBroken] = field(default_factory=list)
    events: int = 0
    hours: int = 0
    endings: Counter[str] = field(default_factory=Counter)
    met: Counter[str] = field(default_factory=Counter)
    checks: Counter[str] = field(default_factory=Counter)
    certified: list[bool] = field(default_factory=list)
    _hash: "hashlib._Hash" = field(default_factory=hashlib.sha256)
    _told: deque[tuple[int, int, str]] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _hour: int = -1

    @property
    def hash(self) -> str:
        """SHA-256 over every event, in order."""
        return self._hash.hexdigest()

    def begin_hour(self, number: int) -> None:
        """Note that an hour begins."""
        self._hour = number
        self.hours += 1

    def note(self, now_ns: int, text: str) -> None:
        """Note an event."""
        self.events += 1
        self._hash.update(f"{now_ns} {text}\n".encode())
        self._told.append((self._hour, now_ns, text))

    def break_rule(self, rule: str, sentence: str) -> None:
        """Note that a rule does not hold; the same of one hour is noted once."""
        found = RuleBroken(rule, self._hour, sentence)
        if all((one.rule, one.hour) != (rule, self._hour) for one in self.broken):
            self.broken.append(found)

    def lines(self, *, hour: int | None = None) -> list[str]:
        """Return the events that are kept, as lines.

        Args:
            hour: Of this hour only.
        """
        return [
            f"{at_ns / NS_PER_S:12.6f}  {text}"
            for of, at_ns, text in self._told
            if hour is None or of == hour
        ]

    def told(self) -> str:
        """Return it in words: what was broken, what had happened, and what crossed the wire."""
        history = self.history
        lines = [
            f"seed {history.seed}, {history.kind}: {len(history.hours)} hours, "
            f"{history.disturbances} disturbances, {self.events} events, hash {self.hash}",
        ]
        if not self.broken:
            return "\n".join((*lines, "every rule held"))
        lines += [f"BROKEN  {one}" for one in self.broken]
        first = self.broken[0]
        for hour in history.hours:
            who = hour.habit.person + ("" if hour.habit.careful else f" ({hour.habit})")
            lines.append(f"hour {hour.number}: {who} sets out to {hour.deed}")
            lines += [f"    in the way: {one}" for one in hour.disturbances]
        lines.append(f"hour {first.hour}, event by event:")
        return "\n".join((*lines, *self.lines(hour=first.hour)))


class CountedActs:
    """Counts requests and hands out what is due.

    Attributes:
        met: How much was handed out since the last :meth:`clear`.
    """

    def __init__(self) -> None:
        self.met = 0
        self._waiting: list[tuple[Disturbance, int]] = []

    def plan(self, disturbance: Disturbance) -> None:
        """Let something happen at a request that is still to come."""
        self._waiting.append((disturbance, disturbance.at))

    def due(self, text: str) -> list[Disturbance]:
        """Count one request and return what happens with it."""
        found, waiting = [], []
        for disturbance, left in self._waiting:
            if disturbance.match not in text:
                waiting.append((disturbance, left))
            elif left:
                waiting.append((disturbance, left - 1))
            else:
                found.append(disturbance)
        self._waiting = waiting
        self.met += len(found)
        return found

    def clear(self) -> int:
        """Plan nothing any more; return how much was met."""
        met, self.met = self.met, 0
        self._waiting.clear()
        return met
