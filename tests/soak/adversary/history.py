"""The events in a cell, hour by hour: drawn from a seed, plain data, easily shortened.

Each hour draws from the seed and its own number, so an hour, or one of its disturbances, can be
left out without changing the others.
"""

import hashlib
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final, Self

from robolink.timing import NS_PER_S


class CellKind(StrEnum):
    """The kind of cell."""

    EPSON = "epson"
    SOFTMOTION = "softmotion"
    EPSON_SERIAL = "epson over rs232"
    MODBUS_TCP = "softmotion over modbus tcp"
    MODBUS_RTU = "softmotion over modbus rtu"
    CANOPEN = "softmotion over canopen"
    OPCUA = "softmotion over opc ua"
    REGISTER_MAP = "plc with a register map"
    PROGRAM = "epson program that calls back"


class Deed(StrEnum):
    """The task that somebody sets out to do."""

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
    """The kind of a disturbance."""

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
    """One disturbance, once.

    Attributes:
        kind: The kind of disturbance.
        what: The fault itself: the name of a wire fault, of an act at the panel ...
        match: Text that a request, or a checkpoint, must contain to be counted; empty counts all.
        at: Its place among those counted, from 0.
        seconds: A delay in virtual time, if it has one.
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
    """The working habits of the person of an hour.

    Attributes:
        person: Their badge.
        stays_share: Share of the touches for which they only press ENTER.
        types_ahead: They press ENTER before they are asked.
        bias_mm: How far beside the pin they always stop.
        tires_mm: By how much their aim wanders from touch to touch.
        declines: They refuse the proposal.
        keeps: After an accident they keep an unverified value.
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
        """Whether each touch is made correctly."""
        return not (self.stays_share or self.types_ahead or self.bias_mm or self.tires_mm)


@dataclass(frozen=True, slots=True)
class Hour:
    """One hour of a cell.

    Attributes:
        number: Its number, from 0, on which its draws depend.
        deed: The task.
        habit: The person, and their habits.
        disturbances: The disturbances.
        line: The typed line if the deed is a command, without the program's name.
    """

    number: int
    deed: Deed
    habit: Habit
    disturbances: tuple[Disturbance, ...]
    line: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class History:
    """The events in one cell.

    Attributes:
        seed: The seed of all its draws.
        kind: The kind of cell.
        hours: Its hours; some may be left out.
    """

    seed: int
    kind: CellKind
    hours: tuple[Hour, ...]

    def harms_disk(self, hour: Hour | None) -> bool:
        """Whether something besides a power cut may have damaged the journal in an hour.

        What a disk that lied in an earlier one has not stored, any later cut loses.
        """
        return hour is None or any(
            one.what == "SYNC_LIES" or (one.kind is Hindrance.DISK and other == hour)
            for other in self.hours
            if other.number <= hour.number
            for one in other.disturbances
        )

    def without_hours(self, dropped: Sequence[int]) -> Self:
        """Return it without some hours, by number."""
        return replace(self, hours=tuple(h for h in self.hours if h.number not in dropped))

    @property
    def disturbances(self) -> int:
        """The number of disturbances."""
        return sum(len(hour.disturbances) for hour in self.hours)


_KEPT: Final = 4000
"""The number of events kept for printing; the hash covers all."""


@dataclass(frozen=True, slots=True)
class RuleBroken:
    """A rule that did not hold.

    Attributes:
        rule: Its name.
        hour: The hour.
        sentence: The observation.
    """

    rule: str
    hour: int
    sentence: str

    def __str__(self) -> str:
        return f"{self.rule} in hour {self.hour}: {self.sentence}"


@dataclass(slots=True)
class Story:
    """The course of one history.

    Attributes:
        history: The planned events.
        broken: Broken rules, in order.
        events: The number of events.
        hours: The number of hours run.
        endings: How the deeds ended, by name, with counts.
        met: The disturbances that occurred, by kind, with counts.
        checks: How often each rule was checked.
        certified: Tested tips, and how many of them were where they were said to be.
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
        """Note a broken rule; the same one in the same hour is noted once."""
        found = RuleBroken(rule, self._hour, sentence)
        if all((one.rule, one.hour) != (rule, self._hour) for one in self.broken):
            self.broken.append(found)

    def lines(self, *, hour: int | None = None) -> list[str]:
        """Return the kept events as lines.

        Args:
            hour: Only events of this hour.
        """
        return [
            f"{at_ns / NS_PER_S:12.6f}  {text}"
            for of, at_ns, text in self._told
            if hour is None or of == hour
        ]

    def told(self) -> str:
        """Return it as text: the broken rules, the events before, and the wire traffic."""
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
    """Counts requests and returns the disturbances that are due.

    Attributes:
        met: The number returned since the last :meth:`clear`.
    """

    def __init__(self) -> None:
        self.met = 0
        self._waiting: list[tuple[Disturbance, int]] = []

    def plan(self, disturbance: Disturbance) -> None:
        """Plan a disturbance at a coming request."""
        self._waiting.append((disturbance, disturbance.at))

    def due(self, text: str) -> list[Disturbance]:
        """Count one request and return the disturbances due at it."""
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
        """Drop all plans; return how many occurred."""
        met, self.met = self.met, 0
        self._waiting.clear()
        return met
