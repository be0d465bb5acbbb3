"""Plans that a seed draws: one seed is one plan, on every machine and in every order of drawing."""

import random
from dataclasses import dataclass
from typing import Final, TypeVar

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.faults.fieldbus import Order, PlcFault, PlcFaultAction
from robolink_simulators.faults.links import AnyAction, LinkKind, links_of, require_possible
from robolink_simulators.faults.stream import EXCEPTION_CODES, Fault, FaultAction

MOST_EXCHANGES: Final = 1_000_000
_ORDERS: Final[tuple[Order, ...]] = ("high_first", "pairs_swapped", "halves_swapped")
_DELAYS_S: Final = (0.0, 0.0, 0.004, 0.05, 0.3, 1.0, 2.9, 3.1, 12.0)
"""Delays in seconds: at once, within a cycle, within a movement, on both sides of the usual
time-out, and beyond the silence after which a client may take over a mailbox.
"""
_FRAME_BYTES: Final = 240
"""Longest usual answer in bytes. A position beyond the end of an answer is counted from its start
again.
"""
_CODES: Final = (4001, 4025, 4242, 2353)
_AXIS_ERRORS: Final = (16, 1, 25)

_EXCHANGES_A_WRITE: Final = 5
"""Approximate number of exchanges per write: most exchanges with a mailbox read it or send a beat.
"""
_OF_WRITES: Final = frozenset(
    {
        PlcFaultAction.DUPLICATE_REQUEST,
        PlcFaultAction.REORDER_WRITE,
        PlcFaultAction.GARBLE_WRITE,
        PlcFaultAction.TEAR_WRITE,
        PlcFaultAction.IGNORE_WRITE,
        PlcFaultAction.READ_ONLY,
    }
)
_OF_READS: Final = frozenset(
    {
        PlcFaultAction.GARBLE_REPLY,
        PlcFaultAction.TEAR_REPLY,
        PlcFaultAction.STALE_REPLY,
        PlcFaultAction.ZERO_REPLY,
        PlcFaultAction.LOSE_SEGMENT,
        PlcFaultAction.WRONG_TOGGLE,
        PlcFaultAction.TEAR_ARRAY,
        PlcFaultAction.SHORT_ARRAY,
    }
)

ONLY_BY_NAME: Final = frozenset(
    {
        FaultAction.MODBUS_EXCEPTION,
        PlcFaultAction.MODBUS_EXCEPTION,
        FaultAction.EXPIRED_CERTIFICATE,
        PlcFaultAction.EXPIRED_CERTIFICATE,
    }
)
"""Faults that are drawn only if named. The exceptions were added later, and a seed without named
faults must still draw the same ones; with an expired certificate nobody would come in any more.
"""

Action = TypeVar("Action", FaultAction, PlcFaultAction)


@dataclass(frozen=True, slots=True)
class FaultRates:
    """How often each fault happens.

    Attributes:
        rate: Faults per exchange, 0 to 1.
        exchanges: Over how many exchanges, at most 1,000,000.
        actions: Which faults are drawn from; none at all means all that the link can have but
            MODBUS_EXCEPTION and EXPIRED_CERTIFICATE.
        match: As of a fault: only requests that contain it are counted.

    Raises:
        ConfigError: A number is out of its range.
    """

    rate: float = 0.01
    exchanges: int = 1000
    actions: tuple[AnyAction, ...] = ()
    match: str = ""

    def __post_init__(self) -> None:
        if not 0 <= self.rate <= 1:
            raise ConfigError(
                tr("A rate of {rate:g} faults per exchange is not possible.", rate=self.rate),
                remedy=tr("Give a rate from 0 to 1."),
            )
        if not 0 <= self.exchanges <= MOST_EXCHANGES:
            raise ConfigError(
                tr("Faults cannot be drawn over {count} exchanges.", count=self.exchanges),
                remedy=tr("Give 0 to {most} exchanges.", most=MOST_EXCHANGES),
            )


def drawn_faults(seed: int, kind: LinkKind, rates: FaultRates) -> tuple[Fault, ...]:
    """Return the faults of a byte stream that a seed draws.

    Args:
        seed: Any number.
        kind: The link: nothing is drawn that it cannot have.
        rates: How many, of which kinds, on which exchanges.

    Raises:
        FaultNotPossibleError: The link cannot have a fault that is asked for.

    Example:
        >>> from robolink_simulators.faults import FaultRates, LinkKind, drawn_faults
        >>> rates = FaultRates(rate=0.5, exchanges=100)
        >>> faults = drawn_faults(7, LinkKind.EPSON_TCP, rates)
        >>> faults == drawn_faults(7, LinkKind.EPSON_TCP, rates), 30 < len(faults) < 70
        (True, True)
    """
    chance = random.Random(f"stream {kind.value} {seed}")
    actions = _drawable(kind, rates, FaultAction)
    return tuple(
        Fault(
            (action := chance.choice(actions)),
            on_exchange=exchange,
            match=rates.match,
            seconds=chance.choice(_DELAYS_S),
            code=chance.choice(EXCEPTION_CODES if action in ONLY_BY_NAME else _CODES),
            position=chance.randrange(_FRAME_BYTES),
            bit=chance.randrange(8),
        )
        for exchange in _exchanges(chance, rates)
    )


def drawn_plc_faults(seed: int, kind: LinkKind, rates: FaultRates) -> tuple[PlcFault, ...]:
    """Return the faults of a mailbox that a seed draws; as :func:`drawn_faults`.

    Args:
        seed: Any number.
        kind: The link: nothing is drawn that it cannot have.
        rates: How many, of which kinds, on which exchanges.

    Raises:
        FaultNotPossibleError: The link cannot have a fault that is asked for.

    Example:
        >>> from robolink_simulators.faults import FaultRates, LinkKind, drawn_plc_faults
        >>> rates = FaultRates(rate=1, exchanges=5)
        >>> len(drawn_plc_faults(7, LinkKind.MAILBOX_SIM, rates))
        5
    """
    chance = random.Random(f"mailbox {kind.value} {seed}")
    actions = _drawable(kind, rates, PlcFaultAction)
    faults = []
    for exchange in _exchanges(chance, rates):
        action = chance.choice(actions)
        on_exchange, match = _place_of(action, exchange, rates.match)
        faults.append(
            PlcFault(
                action,
                on_exchange=on_exchange,
                match=match,
                seconds=chance.choice(_DELAYS_S),
                code=chance.choice(EXCEPTION_CODES if action in ONLY_BY_NAME else _AXIS_ERRORS),
                position=chance.randrange(_FRAME_BYTES),
                bit=chance.randrange(16),
                order=chance.choice(_ORDERS),
            )
        )
    return tuple(faults)


def _place_of(action: PlcFaultAction, exchange: int, match: str) -> tuple[int, str]:
    """Return which of which requests a fault meets: one of a write has to meet a write."""
    if match:
        return exchange, match
    if action in _OF_WRITES:
        return exchange // _EXCHANGES_A_WRITE, "write_command"
    return (exchange, "read") if action in _OF_READS else (exchange, "")


def _exchanges(chance: random.Random, rates: FaultRates) -> list[int]:
    """Return the exchanges that something happens to."""
    # Drawn first, so that a different list of actions does not change the exchanges.
    return [number for number in range(rates.exchanges) if chance.random() < rates.rate]


def _drawable(kind: LinkKind, rates: FaultRates, family: type[Action]) -> list[Action]:
    """Return what is drawn from, in the order of the vocabulary."""
    for action in rates.actions:
        require_possible(action, {kind})
    wanted: tuple[object, ...] = rates.actions or tuple(set(family) - ONLY_BY_NAME)
    drawable = [action for action in family if action in wanted and kind in links_of(action)]
    if not drawable:
        raise ConfigError(
            tr("No fault of this kind can be drawn for {link}.", link=kind.value),
            remedy=tr("Draw for a link that carries such requests."),
        )
    return drawable
