"""Ten thousand changes that call back, with random faults: no unverified value stays.

Each share of them runs on its own controller, PC and journal.
"""

import random
from dataclasses import replace
from typing import Any

import pytest
from robolink_simulators.testkit.program_calls import CallFault

from robolink.model import EntryKind
from tests.faults._callback_cell import MEASURED, PROVED, CallbackCell
from tests.faults._callback_sensors import BEAM_INPUTS, BeamCell, CameraCell, RoundCell

CHANGES = 250
SHARES = {"pin": 20, "beams": 6, "round": 6, "camera": 8}
CELLS = {"pin": CallbackCell, "beams": BeamCell, "round": RoundCell, "camera": CameraCell}


def no_fault(_cell, _rng):
    pass


def bent_exchange(cell, rng):
    """Disturb one exchange, or two."""
    names = tuple(CallFault.__dataclass_fields__)
    first = len(cell.calls.questions)
    struck = {
        first + rng.randrange(cell.exchanges): rng.choice(names) for _ in range(rng.choice((1, 2)))
    }
    cell.calls.fault = lambda at, _line: CallFault(**{struck[at]: True}) if at in struck else None


def pc_restarts(cell, rng):
    at = len(cell.calls.questions) + rng.randrange(cell.exchanges)

    def bend(number, _line):
        if number != at:
            return None
        cell.restart_server()
        return CallFault(cut_before=True)

    cell.calls.fault = bend


def touch_beside(cell, rng):
    first, angles = rng.choice(((11, MEASURED), (21, PROVED)))
    at = rng.randrange(len(angles))
    cell.teach(first + at, angles[at : at + 1], off_mm=rng.choice((-1, 1)) * rng.uniform(0.3, 2))


def aside(rng):
    """Return a bump large enough to count."""
    return rng.choice((-1, 1)) * rng.uniform(0.12, 0.2)


def pin_bumped(cell, rng):
    world, (x, y, z) = cell.simulator.world, cell.simulator.world.pin_mm
    world.pin_mm = (x + aside(rng), y, z)
    cell.teach(21, PROVED)
    cell.undo = lambda: setattr(world, "pin_mm", (x, y, z))


def beam_dark(cell, rng):
    """Keep one of the beams from switching."""
    cell.simulator.world.disconnect(rng.choice(BEAM_INPUTS))
    cell.undo = lambda: cell.stand_at(cell.recorded_mm)


def beams_moved(cell, rng):
    x, y, z = cell.recorded_mm
    cell.stand_at((x + aside(rng), y, z) if rng.random() < 0.5 else (x, y + aside(rng), z))
    cell.undo = lambda: cell.stand_at(cell.recorded_mm)


def furnished(cell, **parameters):
    world = cell.simulator.world
    before = world.parameters
    world.set_up(replace(before, **parameters))
    cell.undo = lambda: world.set_up(before)


def needle_bent(cell, rng):
    furnished(cell, lean_deg=rng.uniform(3, 8), lean_toward_deg=rng.uniform(-180, 180))


def tip_unseen(cell, _rng):
    furnished(cell, camera_miss_share=0.15)


def false_finds(cell, _rng):
    furnished(cell, camera_outlier_share=0.15)


def camera_bumped(cell, rng):
    """Bump the camera once, at some exchange, between two looks or before the turn test."""
    camera, at = cell.simulator.world.camera, len(cell.calls.questions)
    x, y, z = camera.middle_mm
    at += rng.randrange(cell.exchanges)

    def bend(number, _line):
        if number == at:
            camera.middle_mm = (x + aside(rng), y, z)

    cell.calls.fault = bend
    cell.undo = lambda: setattr(camera, "middle_mm", (x, y, z))


FAULTS = (no_fault, bent_exchange, bent_exchange, pc_restarts, None)
"""``None``: the power fails at some statement."""

OWN_FAULTS = {
    "pin": (touch_beside, pin_bumped),
    "beams": (beam_dark, beams_moved, needle_bent),
    "round": (beam_dark, beams_moved, needle_bent),
    "camera": (tip_unseen, false_finds, camera_bumped),
}


def one_change(cell, rng, own_faults):
    """Run one change with random faults; return whether a new value stays."""
    cell.calls.fault, cell.undo = lambda _number, _line: None, lambda: None
    cell.change_needle()
    old, fault = cell.tool, rng.choice((*FAULTS, *own_faults))
    if fault is None:
        cell.run_until(rng.randrange(cell.length))
    else:
        fault(cell, rng)
        cell.run()
    cell.restore()
    cell.undo()
    return cell.require_whole(old)


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ("kind", "share"), [(kind, share) for kind, count in SHARES.items() for share in range(count)]
)
def test_no_unverified_value_stays(tmp_path, record_property, kind, share):
    rng = random.Random(f"changes {kind} {share}")
    cell: Any = CELLS[kind](tmp_path, seed=share + 1)
    try:
        cell.change_needle()
        cell.length = len(cell.statements())
        cell.exchanges = len(cell.calls.questions)
        kept = sum(one_change(cell, rng, OWN_FAULTS[kind]) for _ in range(CHANGES))
        assert CHANGES / 20 < kept < CHANGES * 19 / 20  # both ends occurred
        cell.calls.fault = lambda _number, _line: None
        cell.change_needle()
        assert cell.run() == ["kept"]
        assert cell.open_markers() == []
        assert cell.journal.verify().problems == ()
        # The last recorded value is the tool's.
        (last,) = cell.entries(EntryKind.DONE, limit=1)
        assert list(last.details["value"]) == list(cell.tool.rounded(3).components())
        record_property("kept", kept)
    finally:
        cell.close()
