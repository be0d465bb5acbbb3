"""Which exchanges of a nozzle change are disturbed, and when."""

import os
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Final, Literal

from tests._patience import PATIENCE_S
from tests.faults._client_process import ClientProcess
from tests.faults._nozzle_cell import NozzleCell

Moment = Literal["before it is carried out", "before its answer leaves"]
MOMENTS: Final[tuple[Moment, Moment]] = (
    "before it is carried out",
    "before its answer leaves",
)

SHARES: Final = 8
"""Into so many tests the steps are dealt, so that several workers can share them."""

_EVERY = 48
"""Of all other exchanges, every 48th makes the sample."""

_MATTERS = re.compile(r'\$(Log|Execute,"Tool \d)')
"""Logs in or out, or selects."""

_MOVES = re.compile(r'\$Execute,"(Move |Go )')
_EVERY_MOVE = 3
"""Of the movements, most of which are the jogs of one touch, every third one makes the sample."""

_WRITES = re.compile(r'\$Execute,"TLSet \d')


@dataclass(frozen=True)
class Step:
    """One instant of a nozzle change: an exchange by its running number, and a moment of it."""

    number: int
    moment: Moment
    request: str

    def __str__(self) -> str:
        return f"exchange {self.number}, {self.moment}: {self.request}"


def steps_of(requests: list[str], share: int) -> list[Step]:
    """Return the steps to disturb: all of them, or without the switch a fixed sample.

    The sample has both moments of a write, and of other steps one.
    """
    all_of_them = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"
    chosen: list[Step] = []
    moves = 0
    for number, request in enumerate(requests, start=1):
        moves += bool(_MOVES.match(request))
        due = moves % _EVERY_MOVE == 1 if _MOVES.match(request) else _MATTERS.match(request)
        if all_of_them or _WRITES.match(request):
            chosen += [Step(number, moment, request) for moment in MOMENTS]
        elif number % _EVERY == 1 or due:
            moment = MOMENTS[len(chosen) % 2]
            chosen.append(Step(number, moment, request))
    return chosen[share::SHARES]


def disturbed(cell: NozzleCell, step: Step, act: Callable[[ClientProcess], None]) -> ClientProcess:
    """Start a nozzle change and hold the wire at ``step`` while ``act`` is done to its process."""
    started: SimpleQueue[ClientProcess] = SimpleQueue()
    reached = threading.Event()

    def hold(number: int, _text: str) -> None:
        if number == step.number and not reached.is_set():
            act(started.get(timeout=PATIENCE_S))
            reached.set()

    simulator = cell.simulator
    with simulator.lock:
        if step.moment == MOMENTS[0]:
            simulator.on_request = hold
        else:
            simulator.on_reply = hold
    client = cell.calibrate()
    started.put(client)
    assert reached.wait(PATIENCE_S), "the step was not reached"
    with simulator.lock:
        simulator.on_request = simulator.on_reply = None
    return client
