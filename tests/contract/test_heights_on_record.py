"""A cell's record says how well touch heights repeat, whatever runs the measurement.

At the second touch the person presses the tip 0.15 mm down: within the usual limit for two touches
(0.23 mm), but too much for a person whose recorded touches repeat to 0.01 mm.
"""

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import CalibrationError
from robolink.methods import TwoPoseSource
from robolink.model import EntryKind, NewEntry
from robolink.procedures import TouchPlan
from tests.contract._method_cell import method_cell
from tests.contract.test_touches_not_made import RECIPE, has_habit

pytestmark = pytest.mark.simulator_only

PIN = "PIN-07"


@pytest.fixture
def arm(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        depths = iter((0.0, 0.15))
        asked = cell.world.operator.begin_touch

        def begin_touch(tool=None):
            has_habit(cell, person_presses_mm=next(depths, 0.0))
            return asked(tool)

        cell.world.operator.begin_touch = begin_touch
        yield cell


def has_touched(arm, by, station=PIN):
    """Record twelve touches in four runs that repeat to 0.01 mm in height."""
    touch = {"station": station, "heights_mm2": 3e-4, "heights_dof": 3, "heights_by": by}
    with arm.cell.connected() as controller:
        for _ in range(4):
            entry = NewEntry(EntryKind.DECISION, tool=2, verdict="", details={"touch": touch})
            controller.outcomes.append(entry)


def from_command(arm, _folder):
    return arm.calibrate("two-pose", "--station", PIN)


def from_recipe(arm, folder):
    path = folder / "recipe.toml"
    path.write_text(RECIPE.format(kind="two-pose"))
    return arm.run("recalibrate", str(path), "--assist", arm.cell.url, "--yes", "--json")


def from_learning(arm, _folder):
    return arm.run(
        "station", "learn", PIN, "--tool", "1", "--assist", arm.cell.url, "--yes", "--json"
    )


def check_refused(done):
    assert (done.code, done.document["error"]["code"]) == (7, "touch_heights_differ"), done.err


@pytest.mark.parametrize("run", [from_command, from_recipe, from_learning])
def test_a_person_on_record_is_held_to_it(arm, tmp_path, run):
    has_touched(arm, "person")
    check_refused(run(arm, tmp_path))


def test_touches_that_were_made_otherwise_or_elsewhere_say_nothing_of_it(arm, tmp_path):
    for by, station in (("contact", PIN), ("poses", PIN), ("person", "PIN-08"), (None, PIN)):
        has_touched(arm, by, station)
    done = from_command(arm, tmp_path)
    assert done.code == 0, done.err
    assert arm.recorded(EntryKind.DONE)[0].details["touch"]["heights_by"] == "person"


@pytest.mark.parametrize("stated_mm", [None, 0.05])
def test_a_script_is_held_to_it_unless_it_states_its_own(arm, stated_mm):
    has_touched(arm, "person")
    with robolink.connect(arm.cell.url) as controller:
        source = TwoPoseSource(TouchPlan(sigma_z_mm=stated_mm))
        plan = ChangePlan((ToolPlan(1, source, pin=PIN),), ask_before_write=False)
        eyes = InProcessEyes(arm.cell.simulator)
        person = AssistedOperator.with_eyes(eyes, lambda _: None, clock=controller.clock)
        change = NozzleChange(controller, plan, operator=person)
        if stated_mm:
            assert change.run().tools[0].verification
            return
        with pytest.raises(CalibrationError) as refused:
            change.run()
    assert refused.value.code == "touch_heights_differ"
