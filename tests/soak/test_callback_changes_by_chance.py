"""Ten thousand changes that call back, with faults by chance: no unverified value stays.

Each share of them is a controller, a PC and a journal of its own that live through it.
"""

import random

import pytest

from robolink.model import EntryKind
from tests.faults._callback_cell import MEASURED, PROVED, Bend, CallbackCell

SHARES, CHANGES = 20, 500
QUESTIONS = 14
STATEMENTS = 3_600
"""About as many as a whole change has."""


def no_fault(_cell, _rng):
    pass


def bent_exchange(cell, rng):
    """Something happens to one exchange, or to two."""
    names = tuple(Bend.__dataclass_fields__)
    first = len(cell.relay.questions)
    struck = {
        first + rng.randrange(QUESTIONS): rng.choice(names) for _ in range(rng.choice((1, 2)))
    }
    cell.relay.bend = lambda at, _line: Bend(**{struck[at]: True}) if at in struck else None


def pc_restarts(cell, rng):
    at = len(cell.relay.questions) + rng.randrange(QUESTIONS)

    def bend(number, _line):
        if number != at:
            return None
        cell.restart_server()
        return Bend(cut_before=True)

    cell.relay.bend = bend


def touch_beside(cell, rng):
    first, angles = rng.choice(((11, MEASURED), (21, PROVED)))
    at = rng.randrange(len(angles))
    cell.teach(first + at, angles[at : at + 1], off_mm=rng.choice((-1, 1)) * rng.uniform(0.3, 2))


def pin_bumped(cell, rng):
    x, y, z = cell.simulator.world.pin_mm
    cell.simulator.world.pin_mm = (x + rng.choice((-1, 1)) * rng.uniform(0.12, 0.2), y, z)
    cell.teach(21, PROVED)
    cell.pin_back = (x, y, z)


FAULTS = (no_fault, bent_exchange, bent_exchange, pc_restarts, touch_beside, pin_bumped, None)
"""``None``: the power goes at some statement."""


def one_change(cell, rng):
    """Let one change go as chance has it; tell whether a new value stays."""
    cell.relay.bend, cell.pin_back = lambda _number, _line: None, cell.simulator.world.pin_mm
    cell.change_needle()
    old, fault = cell.tool, rng.choice(FAULTS)
    if fault is None:
        cell.run_until(rng.randrange(STATEMENTS))
    else:
        fault(cell, rng)
        cell.run()
    cell.restore()
    cell.simulator.world.pin_mm = cell.pin_back
    return cell.require_whole(old)


@pytest.mark.soak
@pytest.mark.parametrize("share", range(SHARES))
def test_no_unverified_value_stays(tmp_path, share):
    rng = random.Random(f"changes {share}")
    cell = CallbackCell(tmp_path, seed=share + 1)
    try:
        kept = sum(one_change(cell, rng) for _ in range(CHANGES))
        assert CHANGES / 10 < kept < CHANGES * 9 / 10  # both ends came up
        cell.relay.bend = lambda _number, _line: None
        cell.change_needle()
        assert cell.run() == ["kept"]
        assert cell.open_markers() == []
        assert cell.journal.verify().problems == ()
        # What is on record as last is what the tool holds.
        (last,) = cell.entries(EntryKind.DONE, limit=1)
        assert list(last.details["value"]) == list(cell.tool.rounded(3).components())
    finally:
        cell.close()
