"""With what one touch of the next nozzle is compared, and what follows from a wrong answer."""

import math
from dataclasses import replace
from typing import Any

import pytest

from robolink.calibration import NeedleChain, NeedleLimits, Pin
from robolink.errors import CalibrationError
from robolink.methods import (
    Absolute,
    Difference,
    LastTouch,
    OneTouchSource,
    difference_from_last,
    find_last_touch,
    find_method,
)
from robolink.methods.method import Site
from robolink.model import EntryKind, NewEntry, Path, Pose, ToolOffset, plain_offset
from robolink.runner import Ask, Move
from robolink.stations import Station, StationKind
from robolink.testing import MemoryController, MemoryMachine, PaperCell

HERE = Pose(330.0, 120.0, 20.0, 0.0, tool=0)
STORED = ToolOffset(12.0, -4.0, -20.0)
OTHER = ToolOffset(5.0, 6.0, -30.0)
PIN = (310.0, 95.0, -40.0)


def kept(tool=1, station="PIN-07", value=STORED, **said: Any):
    """Return what is on record of a calibration that was kept."""
    touch = {
        "station": station, "x_mm": PIN[0], "y_mm": PIN[1], "z_mm": PIN[2], "u_deg": 90.0,
        "sigma_mm": 0.03, "changes": 3, "full_sigma_mm": 0.01, "touch_sigma_mm": 0.02,
    }  # fmt: skip
    details = {"touch": touch | said, "value": plain_offset(value)}
    return NewEntry(EntryKind.DONE, tool=tool, details=details)


@pytest.fixture
def controller():
    with MemoryController(MemoryMachine({1: STORED, 2: OTHER})) as controller:
        yield controller


def test_the_newest_touch_of_this_tool_on_this_pin_is_what_counts(controller):
    controller.outcomes.append(kept(x_mm=300.0), kept())
    controller.outcomes.append(kept(station="PIN-08", x_mm=200.0))
    controller.outcomes.append(kept(tool=2, value=OTHER, x_mm=100.0))
    last = find_last_touch(controller, 1, "PIN-07")
    assert last.place_mm == PIN
    assert last.u_deg == 90.0
    assert last.chain == NeedleChain(0.03, 3, 0.01)
    for tool, station in ((2, "PIN-08"), (1, "PIN-09")):
        with pytest.raises(CalibrationError) as refused:
            find_last_touch(controller, tool, station)
        assert refused.value.code == "no_last_touch"


def test_a_touch_that_belongs_to_another_value_is_refused(controller):
    controller.outcomes.append(kept())
    controller.tools.write(1, replace(STORED, y_mm=-4.01), expected=STORED)
    with pytest.raises(CalibrationError) as refused:
        find_last_touch(controller, 1, "PIN-07")
    assert refused.value.code == "reference_outdated"


def test_a_stated_scatter_counts_before_that_of_the_last_touch(controller):
    controller.outcomes.append(kept())
    for stated, used in ((0.05, 0.05), (None, 0.02)):
        solver = difference_from_last(
            controller, 1, "PIN-07", sigma_mm=stated, limits=NeedleLimits()
        )
        assert solver.sigma_mm == used


@pytest.mark.parametrize(("full_mm", "changes"), [(0.03, 3), (0.03, 0), (0.08, 0), (0.08, 4)])
def test_how_many_changes_are_left_is_what_the_changes_themselves_say(full_mm, changes):
    limits, sigma_mm = NeedleLimits(tolerance_mm=0.1, max_changes=6), 0.02
    chain = NeedleChain(math.hypot(full_mm, sigma_mm) if changes else full_mm, changes, full_mm)
    left, made, place = (
        chain.changes_left(math.sqrt(2) * sigma_mm, limits, shared_touch=True),
        0,
        PIN,
    )
    due = bool(changes) and chain.is_due(limits)
    while not due:
        last = LastTouch("PIN-07", place, 90.0, STORED, chain, sigma_mm, nozzle="", at="")
        result: Any = Difference(last, sigma_mm, limits).solve([Pose(298, 99, -20, 0)], STORED)
        chain, due, made = result.chain, result.full_calibration_due, made + 1
    assert left == made


LAST = LastTouch(
    "PIN-07", PIN, 90.0, STORED, NeedleChain(0.03, 3, 0.01), 0.02, nozzle="", at="", touches=4
)


def at_last(tip, u_deg=90.0):
    """Return the flange pose of a touch of the pin."""
    cell = PaperCell(replace(HERE, u_deg=u_deg), tip, PIN)
    steps = OneTouchSource(Absolute(Pin(*PIN), 0.02)).procedure(tip, cell.here)
    return cell.run(steps).inputs[-1]


@pytest.mark.parametrize(("tolerance_mm", "due"), [(0.1, False), (0.05, True)])
def test_a_difference_carries_what_two_touches_scatter_however_many_came_before(tolerance_mm, due):
    limits = NeedleLimits(tolerance_mm=tolerance_mm)
    solver: Any = Difference(LAST, 0.02, limits)
    found = solver.solve([at_last(replace(STORED, x_mm=12.3))], STORED)
    assert found.offset.components()[:3] == pytest.approx((12.3, -4.0, -20.0))
    # u^2 = u0^2 + 2 s^2: the touches between cancel (docs/reference/evidence.md 12).
    assert found.sigma_mm == pytest.approx(0.02)
    assert found.chain.sigma_mm == pytest.approx(math.hypot(0.01, math.sqrt(2) * 0.02))
    assert found.chain.changes == 4
    assert found.full_calibration_due is due


@pytest.mark.parametrize(("solver", "u_deg"), [
    (Difference(LAST, 0.02, NeedleLimits()), 90.0),
    (Absolute(Pin(*PIN), 0.02), 0.0),
])  # fmt: skip
def test_the_tip_comes_down_over_the_pin_at_the_u_of_the_last_touch(solver, u_deg):
    """Where a runout is, another U would show another tip."""
    source = OneTouchSource(solver)
    cell = PaperCell(HERE, STORED, PIN)
    course: Any = source.procedure(STORED, HERE)
    cell.run(course)
    (ask,) = (step for step in cell.steps if isinstance(step, Ask))
    assert ask.foreseen
    assert ask.foreseen.u_deg == u_deg
    moves = [step for step in cell.steps if isinstance(step, Move)]
    beside_mm = (12.0, -4.0) if u_deg == 0.0 else (4.0, 12.0)  # of the tip, base
    for move in moves:
        height_mm = move.target.z_mm - 20.0 - PIN[2]
        assert height_mm >= (source.clearance_mm if move.path is Path.STRAIGHT else 10.0)
    tip = ask.foreseen.x_mm + beside_mm[0], ask.foreseen.y_mm + beside_mm[1]
    assert tip == pytest.approx(PIN[:2])


@pytest.mark.parametrize("pin_sigma_mm", [None, 0.03])
def test_a_tip_is_as_sure_as_its_pin(pin_sigma_mm, controller):
    """Against the place of a pin, the interval is unknown where nobody stated how sure that is."""
    method, site = find_method("one-touch"), site_at(controller, sigma_mm=pin_sigma_mm)
    source: Any = method.source(method.parameters(basis="absolute", clearance_mm=4.0), site)
    found = PaperCell(HERE, STORED, PIN).run(source.procedure(STORED, HERE))
    assert (found.half_width95 == ()) is (pin_sigma_mm is None)
    assert source.clearance_mm == 4.0, "it is compared with the largest change before it begins"
    assert source.adds_touch is False, "the touch can be made again, and none added"


def site_at(controller, **pin):
    x_mm, y_mm, z_mm = PIN
    station = Station(id="PIN-07", kind=StationKind.PIN, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm, **pin)
    return Site(controller=controller, tool=1, station=station, sigma_mm=0.02, max_change_mm=0.5)


def test_a_difference_beyond_the_largest_change_of_the_site_is_refused(controller):
    controller.outcomes.append(kept())
    method = find_method("one-touch")
    source: Any = method.source(method.parameters(), site_at(controller))

    def touched(tip):
        return PaperCell(HERE, tip, PIN).run(source.procedure(STORED, HERE))

    assert touched(replace(STORED, x_mm=12.4)).offset.x_mm == pytest.approx(12.4)
    with pytest.raises(CalibrationError):
        touched(replace(STORED, x_mm=12.6))
