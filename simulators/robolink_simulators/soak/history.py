"""What happens to a cell, hour by hour: drawn from a seed, plain data, cut shorter at will.

Each hour draws from the seed and its own number, so an hour, or one of its disturbances, can be
left out and all others stay as they were.
"""

import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, Self

from robolink_simulators.faults import FaultAction, LinkKind, PlcFaultAction, links_of
from robolink_simulators.faults.instants import drawn_instant, drawn_rarity


class CellKind(StrEnum):
    """What stands in the cell."""

    EPSON = "epson"
    SOFTMOTION = "softmotion"


class Deed(StrEnum):
    """What somebody sets out to do."""

    CHANGE_NOZZLE = "change the nozzle"
    SET_TOOL = "type a tool offset"
    SET_TWO = "type two tool offsets"
    SELECT_TOOL = "select a tool"
    UNDO = "undo the last change"


class Hindrance(StrEnum):
    """What kind of thing gets in the way."""

    WIRE = "wire"
    MACHINE = "machine"
    STOP = "stop"
    KILL = "kill"
    POWER_CUT = "power cut"
    PENDANT = "pendant"
    SECOND_PERSON = "second person"
    DISK = "disk"
    CLOCK = "clock"
    INTERRUPT = "interrupt"
    ANOTHER_CLIENT = "another client"


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
    """

    number: int
    deed: Deed
    habit: Habit
    disturbances: tuple[Disturbance, ...]


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

    @classmethod
    def drawn(cls, seed: int, hours: int, kind: CellKind | None = None) -> Self:
        """Return the history of a seed.

        Args:
            seed: Decides everything.
            hours: How many hours; each has one change and one disturbance at least.
            kind: What stands in the cell; by default the seed decides.
        """
        own = kind or list(CellKind)[seed % len(CellKind)]
        return cls(seed, own, tuple(_hour(seed, number, own) for number in range(hours)))

    def without_hours(self, dropped: Sequence[int]) -> Self:
        """Return it without some hours, by number."""
        return replace(self, hours=tuple(h for h in self.hours if h.number not in dropped))

    @property
    def disturbances(self) -> int:
        """How many there are."""
        return sum(len(hour.disturbances) for hour in self.hours)


def _hour(seed: int, number: int, kind: CellKind) -> Hour:
    rng = random.Random(f"hour {number} of {seed}")
    deed = rng.choices(list(_DEEDS), list(_DEEDS.values()))[0]
    drawn = [_disturbance(rng, kind, deed)]
    while rng.random() < _ANOTHER_SHARE and len(drawn) < _MOST:
        drawn.append(_disturbance(rng, kind, deed))
    rarely = random.Random(f"rare {number} of {seed}")
    if rare := drawn_rarity(rarely, kind.value, deed.value):
        drawn.append(Disturbance(Hindrance(rare.kind), rare.what, rare.match))
    return Hour(number, deed, _habit(rng), tuple(drawn))


def _habit(rng: random.Random) -> Habit:
    habit = Habit(
        person=rng.choice(("anna", "ben")),
        keeps=rng.random() < 0.15,
        impatient=rng.random() < 0.35,
    )
    if rng.random() < 0.75:
        return habit
    return replace(
        habit,
        **rng.choice(
            (
                {"stays_share": 1.0},
                {"stays_share": 0.5},
                {"types_ahead": True},
                {"bias_mm": 0.3},
                {"tires_mm": 0.1},
                {"declines": True},
            )
        ),
    )


_DEEDS: Final = {
    Deed.CHANGE_NOZZLE: 0.6,
    Deed.SET_TOOL: 0.14,
    Deed.SET_TWO: 0.1,
    Deed.SELECT_TOOL: 0.06,
    Deed.UNDO: 0.1,
}
_ANOTHER_SHARE: Final = 0.25
_MOST: Final = 4
_HINDRANCES: Final = {
    Hindrance.WIRE: 0.3,
    Hindrance.MACHINE: 0.14,
    Hindrance.STOP: 0.24,
    Hindrance.KILL: 0.16,
    Hindrance.POWER_CUT: 0.05,
    Hindrance.PENDANT: 0.05,
    Hindrance.SECOND_PERSON: 0.05,
    Hindrance.DISK: 0.06,
    Hindrance.CLOCK: 0.03,
    Hindrance.INTERRUPT: 0.06,
}

_LINKS: Final = {CellKind.EPSON: LinkKind.EPSON_SIM, CellKind.SOFTMOTION: LinkKind.MAILBOX_SIM}
MACHINE_FAULTS: Final = {
    CellKind.EPSON: (
        FaultAction.ESTOP,
        FaultAction.GUARD_OPEN,
        FaultAction.DEVICE_FAULT,
        FaultAction.SERIOUS_ERROR,
        FaultAction.RESTART,
        FaultAction.LOSE_LOGIN,
        FaultAction.TEACH_MODE,
    ),
    CellKind.SOFTMOTION: (
        PlcFaultAction.ESTOP,
        PlcFaultAction.AXIS_ERROR,
        PlcFaultAction.RESTART,
        PlcFaultAction.FREEZE,
        PlcFaultAction.FREEZE_HEARTBEAT,
        PlcFaultAction.WITHDRAW_PERMIT,
        PlcFaultAction.TAKE_OWNERSHIP,
        PlcFaultAction.WORD_ORDER,
        PlcFaultAction.SHIFT_MAP,
    ),
}
"""What happens to the machine itself."""


def _wire_faults(kind: CellKind) -> tuple[str, ...]:
    family = FaultAction if kind is CellKind.EPSON else PlcFaultAction
    return tuple(
        action.name
        for action in family
        if action not in MACHINE_FAULTS[kind] and _LINKS[kind] in links_of(action)
    )


WIRE_FAULTS: Final = {kind: _wire_faults(kind) for kind in CellKind}
"""What happens on the wire, by name."""

_DISK_FAULTS: Final = ("FULL", "UNWRITABLE", "SYNC_FAILS", "bent", "truncated", "lost")

# What the requests of each kind contain, where a fault tells most, with how many there are.
_PLACES: Final = {
    CellKind.EPSON: (
        ("", 700),
        ("TLSet 1, XY", 2),
        ("TLSet", 6),
        ("Tool ", 4),
        ("Move ", 18),
        ("Go ", 4),
        ("Login", 1),
        ("Abort", 1),
        ("Print Tool", 10),
    ),
    CellKind.SOFTMOTION: (
        ("", 700),
        ("WRITE_TOOL", 3),
        ("SELECT_TOOL", 4),
        ("MOVE_LINEAR", 18),
        ("MOVE_DIRECT", 4),
        ("OWNERSHIP", 2),
        ("read_slot", 8),
        ("beat", 30),
        ("STOP", 1),
    ),
}
_POINTS: Final = {
    CellKind.EPSON: (
        ("", 2600),
        ("commit", 150),
        ("commit after", 75),
        ("TLSet 1, XY", 4),
        ("Tool ", 8),
        ("Move ", 60),
        ("lock Move", 15),
        ("lock TLSet 1, XY", 2),
        ("procedure", 40),
        ("wire sent", 700),
        ("question", 60),
        ("step", 30),
    ),
    CellKind.SOFTMOTION: (
        ("", 2600),
        ("commit", 150),
        ("commit after", 75),
        ("WRITE_TOOL", 4),
        ("SELECT_TOOL", 8),
        ("MOVE_LINEAR", 60),
        ("lock 2103", 15),
        ("lock 5205", 2),
        ("procedure", 40),
        ("wire sent", 700),
        ("question", 60),
        ("step", 30),
    ),
}


def _disturbance(rng: random.Random, kind: CellKind, deed: Deed) -> Disturbance:
    if found := drawn_instant(rng, kind.value, deed.value):
        instant, at = found
        seconds = rng.choice((0.0, 0.01, 5.0, 20.0))
        return Disturbance(Hindrance(instant.kind), instant.what, instant.match, at, seconds)
    hindrance = rng.choices(list(_HINDRANCES), list(_HINDRANCES.values()))[0]
    short = deed is not Deed.CHANGE_NOZZLE
    places = _POINTS if hindrance in _AT_CHECKPOINTS else _PLACES
    match, count = rng.choice(places[kind])
    if short:
        count = max(1, count // 20)
    at = rng.randrange(count)
    what, seconds, position = "", 0.0, None
    if hindrance is Hindrance.WIRE:
        what = rng.choice(WIRE_FAULTS[kind])
        seconds = rng.choice((0.05, 0.5, 2.0, 5.0, 20.0))
        position = rng.choice((None, None, *range(12)))
    elif hindrance is Hindrance.MACHINE:
        what = rng.choice(MACHINE_FAULTS[kind]).name
        seconds = rng.choice((0.0, 0.0, 0.01, 0.3))
    elif hindrance is Hindrance.DISK:
        what = rng.choice(_DISK_FAULTS)
        match, at = "commit before", rng.randrange(8 if short else 75)
    elif hindrance is Hindrance.POWER_CUT:
        what = rng.choice(("", "SYNC_LIES"))
    elif hindrance is Hindrance.CLOCK:
        seconds = rng.choice((-86400.0, -5.0, 3600.0, 40 * 86400.0))
    return Disturbance(hindrance, what, match, at, seconds, position)


_AT_CHECKPOINTS: Final = frozenset(
    {
        Hindrance.STOP,
        Hindrance.KILL,
        Hindrance.POWER_CUT,
        Hindrance.SECOND_PERSON,
        Hindrance.DISK,
        Hindrance.CLOCK,
        Hindrance.INTERRUPT,
    }
)
