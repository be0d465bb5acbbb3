"""The hours of a seed: the cell, its deeds, the habits of its people, and the disturbances."""

import random
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from robolink_simulators.faults import FaultAction, LinkKind, PlcFaultAction, links_of
from robolink_simulators.faults.drawn import ONLY_BY_NAME

from tests.soak.adversary.command_lines import drawn_line
from tests.soak.adversary.deed_lengths import length_of
from tests.soak.adversary.history import (
    CellKind,
    Deed,
    Disturbance,
    Habit,
    Hindrance,
    History,
    Hour,
)
from tests.soak.adversary.instants import drawn_instant, drawn_rarity
from tests.soak.adversary.plant.lines import LineBend

MAILBOX_KINDS: Final = frozenset(
    {
        CellKind.SOFTMOTION,
        CellKind.MODBUS_TCP,
        CellKind.MODBUS_RTU,
        CellKind.CANOPEN,
        CellKind.OPCUA,
    }
)
LINE_KINDS: Final = frozenset({CellKind.EPSON_SERIAL, CellKind.MODBUS_RTU, CellKind.REGISTER_MAP})
"""Cells with a serial line, whose bytes may be lost, swapped, changed or added to."""

_LINKS: Final = {
    CellKind.EPSON: LinkKind.EPSON_SIM,
    CellKind.EPSON_SERIAL: LinkKind.EPSON_SERIAL,
    CellKind.SOFTMOTION: LinkKind.MAILBOX_SIM,
    CellKind.MODBUS_TCP: LinkKind.MODBUS_TCP,
    CellKind.MODBUS_RTU: LinkKind.MODBUS_RTU,
    CellKind.CANOPEN: LinkKind.CAN,
    CellKind.OPCUA: LinkKind.OPCUA,
    CellKind.REGISTER_MAP: LinkKind.PLC_RTU,
}
_OF_EPSON: Final = (
    FaultAction.ESTOP,
    FaultAction.GUARD_OPEN,
    FaultAction.DEVICE_FAULT,
    FaultAction.SERIOUS_ERROR,
    FaultAction.RESTART,
    FaultAction.LOSE_LOGIN,
    FaultAction.TEACH_MODE,
)
_OF_MAILBOX: Final = (
    PlcFaultAction.ESTOP,
    PlcFaultAction.AXIS_ERROR,
    PlcFaultAction.RESTART,
    PlcFaultAction.FREEZE,
    PlcFaultAction.FREEZE_HEARTBEAT,
    PlcFaultAction.WITHDRAW_PERMIT,
    PlcFaultAction.TAKE_OWNERSHIP,
    PlcFaultAction.WORD_ORDER,
    PlcFaultAction.SHIFT_MAP,
)
_OF_MACHINES: Final = frozenset((*_OF_EPSON, *_OF_MAILBOX))
_NOT_OF_WIRES: Final = _OF_MACHINES | ONLY_BY_NAME


def _machine_faults(kind: CellKind) -> tuple[str, ...]:
    match kind:
        case CellKind.EPSON:
            return (*(action.name for action in _OF_EPSON), "GIVES_UP")
        case CellKind.EPSON_SERIAL:
            return tuple(action.name for action in _OF_EPSON)
        case CellKind.REGISTER_MAP:
            return ("WITHDRAW_PERMIT", "SILENT", "REFUSE", "RESTART")
        case CellKind.PROGRAM:
            return ("RESTART", "ESTOP", "PIN_BUMPED", "TOUCH_BESIDE")
    link = _LINKS[kind]
    return tuple(action.name for action in _OF_MAILBOX if link in links_of(action))


def _wire_faults(kind: CellKind) -> tuple[str, ...]:
    if kind is CellKind.PROGRAM:
        return (
            "DROP_ASKED",
            "DROP_ANSWERED",
            "BEND_ASKED",
            "BEND_ANSWERED",
            "CUT_BEFORE",
            "CUT_AFTER",
        )
    family = PlcFaultAction if kind in MAILBOX_KINDS else FaultAction
    link = _LINKS[kind]
    return tuple(
        action.name for action in family if action not in _NOT_OF_WIRES and link in links_of(action)
    )


MACHINE_FAULTS: Final[Mapping[CellKind, tuple[str, ...]]] = {
    kind: _machine_faults(kind) for kind in CellKind
}
"""Faults of the machine itself, by name."""

WIRE_FAULTS: Final[Mapping[CellKind, tuple[str, ...]]] = {
    kind: _wire_faults(kind) for kind in CellKind
}
"""Faults on the wire, by name."""


_TURNS: Final = (
    *(CellKind.EPSON, CellKind.SOFTMOTION) * 2,
    CellKind.EPSON_SERIAL,
    CellKind.MODBUS_RTU,
    CellKind.EPSON,
    CellKind.CANOPEN,
    CellKind.REGISTER_MAP,
    CellKind.PROGRAM,
    CellKind.EPSON,
    CellKind.SOFTMOTION,
    CellKind.MODBUS_TCP,
    CellKind.EPSON_SERIAL,
    CellKind.MODBUS_RTU,
    CellKind.SOFTMOTION,
    CellKind.REGISTER_MAP,
    CellKind.PROGRAM,
    CellKind.EPSON,
    CellKind.MODBUS_TCP,
)
"""The kinds of cells of seeds 0, 1, 2 .. 19, and so on.

``CellKind.OPCUA`` came later and is asked for by name, so that each seed keeps its history.
"""

_ANOTHER_SHARE: Final = 0.6
_MOST: Final = 4
_SHARES: Final = {
    Deed.CHANGE_NOZZLE: 0.46,
    Deed.SET_TOOL: 0.12,
    Deed.SET_TWO: 0.1,
    Deed.SELECT_TOOL: 0.07,
    Deed.UNDO: 0.09,
    Deed.SET_THEN_UNDO: 0.06,
    Deed.MOVE_AND_LEAVE: 0.06,
    Deed.COMMAND: 0.24,
}
_OF_REGISTERS: Final = (
    Deed.SET_TOOL,
    Deed.SET_TWO,
    Deed.UNDO,
    Deed.SET_THEN_UNDO,
    Deed.COMMAND,
)
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
    Hindrance.HAND: 0.08,
    Hindrance.FREEZE: 0.04,
}
_FAMILIES: Final[Mapping[CellKind, str]] = {
    CellKind.EPSON: CellKind.EPSON.value,
    CellKind.EPSON_SERIAL: CellKind.EPSON.value,
    **dict.fromkeys(MAILBOX_KINDS, CellKind.SOFTMOTION.value),
}
"""The name under which a kind's significant instants are listed."""

_LINE_SHARE: Final = 0.2
_PRODUCTION_SHARE: Final = 0.1
_NO_ROBOLINK: Final = frozenset(
    {
        Hindrance.STOP,
        Hindrance.PENDANT,
        Hindrance.SECOND_PERSON,
        Hindrance.INTERRUPT,
        Hindrance.HAND,
        Hindrance.FREEZE,
    }
)
"""Disturbances that a program with call-back lacks: nobody is at robolink's keyboard."""

_JUMPS_S: Final = (-86400.0, -5.0, 3600.0, 40 * 86400.0)
"""Errors of the clock."""

_CLOCK_SHARE: Final = 0.7
_TAKEN_BACK_SHARE: Final = 0.1
_FREEZE_SHARE: Final = 0.08
"""The share of deeds with the disturbance that is significant only for them."""

_NOT_ALWAYS_ASKED: Final = 3
"""Questions counted in a change that some seeds do not reach."""

_WHILE_ASKED: Final = frozenset({Hindrance.HAND, Hindrance.FREEZE})
_QUESTION: Final = "question"
"""Disturbances that occur only while robolink asks something, and their place."""

_DISK_FAULTS: Final = ("FULL", "UNWRITABLE", "SYNC_FAILS", "bent", "truncated", "lost")
_BY_REQUESTS: Final = frozenset(
    {
        Hindrance.WIRE,
        Hindrance.LINE,
        Hindrance.MACHINE,
        Hindrance.PENDANT,
        Hindrance.PRODUCTION,
    }
)
"""Disturbances placed at a request that the machine receives; others at a point passed."""


def drawn_history(seed: int, hours: int, kind: CellKind | None = None) -> History:
    """Return the history of a seed.

    Args:
        seed: Decides everything.
        hours: The number of hours; each has one change and one disturbance at least.
        kind: The kind of cell; by default the seed decides.

    Example:
        >>> from tests.soak.adversary import CellKind, drawn_history
        >>> history = drawn_history(23, 2, CellKind.EPSON)
        >>> [str(hour.deed) for hour in history.hours]
        ['change the nozzle', 'type a tool offset']
        >>> history == drawn_history(23, 3, CellKind.EPSON).without_hours([2])
        True
    """
    own = kind or _TURNS[seed % len(_TURNS)]
    return History(seed, own, tuple(_hour(seed, number, own) for number in range(hours)))


def _hour(seed: int, number: int, kind: CellKind) -> Hour:
    rng = random.Random(f"hour {number} of {seed}")
    deeds = deeds_of(kind)
    deed = rng.choices(list(deeds), list(deeds.values()))[0]
    drawn = [_disturbance(rng, kind, deed)]
    while rng.random() < _ANOTHER_SHARE and len(drawn) < _MOST:
        drawn.append(_disturbance(rng, kind, deed))
    rarely = random.Random(f"rare {number} of {seed}")
    rare = drawn_rarity(rarely, _FAMILIES.get(kind, ""), deed.value)
    if rare is not None:
        drawn.append(Disturbance(Hindrance(rare.kind), rare.what, rare.match))
    told = _of_the_deed(random.Random(f"deed {number} of {seed}"), kind, deed)
    # A disturbance at a question comes alone: any other would mostly end the deed before it.
    drawn = told if told and told[0].kind in _WHILE_ASKED else drawn + told
    line: tuple[str, ...] = ()
    if deed is Deed.COMMAND:
        line = drawn_line(random.Random(f"line {number} of {seed}"))
    return Hour(number, deed, _habit(rng), tuple(drawn), line)


def _of_the_deed(rng: random.Random, kind: CellKind, deed: Deed) -> list[Disturbance]:
    """Return disturbances for one deed only, which would hardly ever coincide by chance."""
    chance, at = rng.random(), rng.randrange(5)
    if deed is Deed.SET_THEN_UNDO and chance < _CLOCK_SHARE:
        jump_s = rng.choice(_JUMPS_S)
        return [Disturbance(Hindrance.CLOCK, match=_QUESTION, at=1, seconds=jump_s)]
    if deed is not Deed.CHANGE_NOZZLE:
        return []
    if chance < _TAKEN_BACK_SHARE:  # a hand during the turn test, and then a stop
        last = dict(length_of(kind, deed).points)[_QUESTION] - _NOT_ALWAYS_ASKED
        return [
            Disturbance(Hindrance.HAND, "type", _QUESTION, last - at % 3),
            Disturbance(Hindrance.INTERRUPT, match=_QUESTION, at=last),
        ]
    if chance < _TAKEN_BACK_SHARE + _FREEZE_SHARE:
        return [Disturbance(Hindrance.FREEZE, match=_QUESTION, at=at)]
    return []


def deeds_of(kind: CellKind) -> Mapping[Deed, float]:
    """Return the deeds for a kind of cell, with their weights."""
    if kind is CellKind.PROGRAM:
        return {Deed.PRODUCE: 1.0}
    if kind is CellKind.REGISTER_MAP:
        return {deed: _SHARES[deed] for deed in _OF_REGISTERS}
    return _SHARES


def _hindrances(kind: CellKind, *, asks: bool) -> Mapping[Hindrance, float]:
    shares = dict(_HINDRANCES)
    if not asks:
        shares = {one: share for one, share in shares.items() if one not in _WHILE_ASKED}
    if kind in LINE_KINDS:
        shares[Hindrance.LINE] = _LINE_SHARE
    if kind in MAILBOX_KINDS:
        shares[Hindrance.PRODUCTION] = _PRODUCTION_SHARE
    if kind is CellKind.PROGRAM:
        shares = {one: share for one, share in shares.items() if one not in _NO_ROBOLINK}
    return shares


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


def _told_instant(rng: random.Random, kind: CellKind, deed: Deed) -> Disturbance | None:
    """Return a fault at a significant instant that the link can have, mostly ``None``."""
    found = drawn_instant(rng, _FAMILIES.get(kind, ""), deed.value)
    if found is None:
        return None
    instant, at = found
    if instant.kind == Hindrance.WIRE and instant.what not in WIRE_FAULTS[kind]:
        return None
    if instant.kind == Hindrance.MACHINE and instant.what not in MACHINE_FAULTS[kind]:
        return None
    if instant.kind == Hindrance.CLOCK:
        seconds = rng.choice(_JUMPS_S)
    else:
        seconds = rng.choice((0.0, 0.01, 5.0, 20.0))
    return Disturbance(Hindrance(instant.kind), instant.what, instant.match, at, seconds)


def _disturbance(rng: random.Random, kind: CellKind, deed: Deed) -> Disturbance:
    if (told := _told_instant(rng, kind, deed)) is not None:
        return told
    length = length_of(kind, deed)
    shares = _hindrances(kind, asks=_QUESTION in dict(length.points))
    hindrance = rng.choices(list(shares), list(shares.values()))[0]
    places = length.requests if hindrance in _BY_REQUESTS else length.points
    match, count = rng.choice(places)
    at = rng.randrange(count)
    what, seconds, position = "", 0.0, None
    match hindrance:
        case Hindrance.WIRE:
            what = rng.choice(WIRE_FAULTS[kind])
            seconds = rng.choice((0.05, 0.5, 2.0, 5.0, 20.0))
            position = rng.choice((None, None, *range(12)))
        case Hindrance.LINE:
            what = rng.choice(list(LineBend)).name
            position = rng.choice((None, *range(40)))
        case Hindrance.MACHINE:
            what = rng.choice(MACHINE_FAULTS[kind])
            seconds = rng.choice((0.0, 0.0, 0.01, 0.3))
            position = rng.randrange(3)
        case Hindrance.PRODUCTION:
            seconds = rng.choice((0.5, 3.0, 20.0))
        case Hindrance.DISK:
            what = rng.choice(_DISK_FAULTS)
            match, at = "commit before", rng.randrange(max(1, length.commits))
        case Hindrance.POWER_CUT:
            what = rng.choice(("", "SYNC_LIES"))
        case Hindrance.HAND | Hindrance.FREEZE:
            match, at = _QUESTION, rng.randrange(dict(length.points)[_QUESTION])
            if hindrance is Hindrance.HAND:
                chooses = kind is not CellKind.REGISTER_MAP and rng.random() < 0.5
                what, position = ("select", rng.randrange(4)) if chooses else ("type", None)
        case Hindrance.CLOCK:
            seconds = rng.choice(_JUMPS_S)
    return Disturbance(hindrance, what, match, at, seconds, position)
