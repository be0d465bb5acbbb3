"""A station is used in the base in which it was learnt (docs/reference/spel.md 5.4)."""

from dataclasses import replace

import pytest

from robolink.errors import NotReadyError, NotReadyReason
from robolink.model import EntryKind
from robolink.stations import (
    Found,
    StationKind,
    base_now,
    find_station,
    learnt_elsewhere,
    require_base_of,
    station_entry,
)

pytestmark = pytest.mark.simulator_only

RAISED = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0)
LEARN = ("station", "learn", "PIN-07", "--tool", "1", "--yes", "--json")


RECIPE = """
schema = "robolink/recipe/1"
name = "one nozzle"
basis = "absolute"
z = "kept"
verify = false

[source]
{method}

[station]
id = "PIN-07"

[[tools]]
number = 1
"""


@pytest.fixture
def learnt(arm):
    """Return a cell whose pin is recorded in the robot's own base."""
    x_mm, y_mm, z_mm = arm.world.pin_mm
    place = {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm}
    found = Found(id="PIN-07", kind=StationKind.PIN, sigma_mm=0.01, **place)
    with arm.cell.connected() as controller:
        controller.outcomes.append(station_entry(found, base=base_now(controller)))
    return arm


def raise_base(arm, place=RAISED):
    arm.cell.simulator.machine.robot.move_base(place)


def test_a_calibration_that_finds_the_pin_keeps_the_base(arm):
    more = ("--count", "4", "--sigma", "0.01", "--no-verify")
    done = arm.calibrate("n-angle", "--station", "PIN-07", *more)
    assert done.code == 0, done.err
    (entry,) = arm.recorded(EntryKind.STATION)
    assert entry.details["base"] == [0.0] * 6


def refused(done):
    assert done.code == 5, done.err
    error = done.document["error"]
    assert error["kind"] == "NotReadyError"
    assert "Station PIN-07" in error["what"]
    assert "X 0 Y 0 Z 5 U 0 V 0 W 0" in error["what"]


@pytest.mark.parametrize("words", [("one-touch",), ("n-angle", "--count", "4")])
def test_in_another_base_nothing_moves_with_yes(learnt, words):
    raise_base(learnt)
    moves = learnt.cell.simulator.machine.arm.moves_started
    done = learnt.calibrate(*words, "--station", "PIN-07")
    refused(done)
    assert learnt.cell.simulator.machine.arm.moves_started == moves


@pytest.mark.parametrize("method", ['kind = "two-pose"', 'kind = "one-touch"'])
def test_a_recipe_is_refused_too(learnt, tmp_path, method):
    path = tmp_path / "nozzle.toml"
    path.write_text(RECIPE.format(method=method))
    raise_base(learnt)
    words = ("--assist", learnt.cell.url, "--yes", "--json")
    refused(learnt.run("recalibrate", str(path), *words))
    assert learnt.cell.simulator.machine.arm.moves_started == 0


def test_of_another_base_only_what_the_cell_file_says_is_a_place_to_go_to(learnt):
    learnt.mount()
    beams = Found(id="BEAMS-02", kind=StationKind.BEAMS, x_mm=None, y_mm=None, z_mm=400.0)
    with learnt.cell.connected() as controller:
        for one in (beams, replace(beams, id="BEAMS-03")):
            controller.outcomes.append(station_entry(one, base=RAISED))
    words = ("--tool", "1", "--yes", "--json", "--assist", learnt.cell.url)
    done = learnt.run("station", "learn", "BEAMS-02", *words)
    assert done.code == 0, done.err
    assert "another base" in done.err
    newest = learnt.recorded(EntryKind.STATION)[0]
    assert newest.details["base"] == [0.0] * 6
    assert newest.details["z_mm"] < 0
    undeclared = learnt.run("station", "learn", "BEAMS-03", *words)
    assert undeclared.code == 5
    assert "BEAMS-03" in undeclared.document["error"]["what"]


def test_a_pin_is_learnt_again_in_the_other_base(learnt):
    raise_base(learnt)
    done = learnt.run(*LEARN, "--assist", learnt.cell.url, "--sigma", "0.01")
    assert done.code == 0, done.err
    assert "another base" in done.err
    newest = learnt.recorded(EntryKind.STATION)[0]
    assert newest.details["base"] == list(RAISED)


def test_what_is_a_station_of_another_base(learnt):
    entries = learnt.recorded(EntryKind.STATION)
    station = find_station(None, entries, "PIN-07")
    with learnt.cell.connected() as controller:
        assert base_now(controller) == station.base == (0.0,) * 6
        require_base_of(controller, station)
        for place, same in (
            ((0.0, 0.001, 0.0, 0.0, 0.0, 0.0), True),
            ((0.0, 0.0, 0.0, 0.002, 0.0, 0.0), False),
            ((0.0, -0.002, 0.0, 0.0, 0.0, 0.0), False),
            (RAISED, False),
        ):
            raise_base(learnt, place)
            assert (learnt_elsewhere(controller, station) is None) is same, place
        with pytest.raises(NotReadyError) as told:
            require_base_of(controller, station)
        assert told.value.reason is NotReadyReason.OTHER_BASE
        # An unknown base is no reason to refuse.
        require_base_of(controller, station.at(1, 2, 3))
