"""How long the robot will take is said before the first run too, and held against what it took."""

from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.epson.arm.kinematics import solve

from robolink.controllers.epson.link import EpsonLink
from robolink.model import Hand, Pose
from tests.contract._shipped_cells import CELLS, shipped_cell, touched, with_cell_file

pytestmark = pytest.mark.simulator_only

WITHIN = 0.1
MACHINES = {
    "five-axes-pivot": "Kin_5Axes",
    "sphere": "Kin_5Axes",
    "gantry-touch-probe": "Kin_Gantry3",
}
"""By recipe: what moves; a T6 moves by the others."""

DEPENDS_ON_THE_FIRST_TOUCHES = "leaning-plate"
PARKED = Pose(158.635, 495.439, -80, 0)


def first_run(cell, *, left_out=0):
    """What was said before the first run, held against what the robot took."""
    done = cell.change(*cell.words)
    assert done.code == 0, done.err
    said, took_s = done.document["robot_time"], done.document["robot_s"]
    assert (said["earlier_runs"], said["moves_left_out"]) == (0, left_out)
    if not left_out:
        assert said["about_s"] == pytest.approx(took_s, rel=WITHIN)
        assert said["with_move_to_start"]
    return said, took_s


def on(cell, model_name):
    """The same cell with another robot, parked where the recipe begins."""
    arm = cell.simulator.machine.arm
    assert arm.model.name == model_name
    arm.place(solve(arm.model, PARKED, Hand.RIGHT), 0)
    return cell


def edited(cell, tmp_path, *changes):
    """The cell with a recipe in which some lines are others."""
    text = cell.recipe.read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    path = Path(tmp_path) / "edited.toml"
    path.write_text(text)
    return replace(cell, recipe=path)


def test_a_robot_of_a_known_model_is_timed_by_what_its_maker_says():
    with touched("needle-beams.toml", robot="GX8-C653S") as cell:
        cell.simulator.answer_s = 0.02
        said, _ = first_run(on(cell, "GX8-C653S"))
        assert said["answer_ms"] == 20
        sent = []
        cell.simulator.on_request = lambda _number, request: sent.append(str(request))
        again = cell.change("--dry-run", "--json").document
        assert again["robot_time"]["earlier_runs"] == 1
        assert not [one for one in sent if "SpeedFactor" in one or "TargetOK" in one]


def test_a_cell_file_states_the_speeds_of_joints():
    with (
        shipped_cell("gantry-touch-probe", 20) as cell,
        with_cell_file(cell, "Kin_Gantry3") as named,
    ):
        first_run(named)


@pytest.mark.soak
def test_moves_of_another_recipe_tell_how_fast_joints_are(tmp_path):
    with shipped_cell("scara-pin") as cell:
        first, took_s = first_run(cell, left_out=4)
        # The same robot at the same speeds, in a recipe that lifts higher.
        other = edited(cell, tmp_path, ("lift_mm = 10", "lift_mm = 12"))
        said = other.change("--dry-run", "--json").document["robot_time"]
        assert (said["earlier_runs"], said["changed"]) == (0, True)
        assert said["moves_left_out"] == 0
        assert first["about_s"] + 4 < said["about_s"] == pytest.approx(took_s, rel=0.2)


@pytest.mark.soak
@pytest.mark.parametrize("answer_ms", [0, 20, 50])
@pytest.mark.parametrize("name", [one for one in CELLS if one != DEPENDS_ON_THE_FIRST_TOUCHES])
def test_it_is_said_of_every_shipped_recipe_before_its_first_run(name, answer_ms):
    with (
        shipped_cell(name, answer_ms) as cell,
        with_cell_file(cell, MACHINES.get(name, "T6-602S")) as named,
    ):
        first_run(named)


@pytest.mark.soak
def test_what_depends_on_the_first_touches_is_not_said():
    with (
        shipped_cell(DEPENDS_ON_THE_FIRST_TOUCHES) as cell,
        with_cell_file(cell, "Kin_5Axes") as named,
    ):
        done = named.change("--dry-run", "--json")
        assert "is not known before the first run of this kind" in done.err
        assert done.document["robot_time"]["about_s"] is None


@pytest.mark.soak
@pytest.mark.parametrize(
    ("before", "after"),
    [("percent = 10", "percent = 2"), ("mm_s = 60", "mm_s = 30"), ("repeats = 1", "repeats = 2")],
)
def test_other_speeds_and_rounds_are_in_it(tmp_path, before, after):
    with touched("needle-beams.toml", robot="GX8-C652S") as cell:
        first_run(edited(on(cell, "GX8-C652S"), tmp_path, (before, after)))


@pytest.mark.soak
def test_an_acceleration_that_the_cell_states_is_in_it():
    with shipped_cell("needle-beams") as cell:
        lines = ("acceleration_mm_s2 = 150",)
        with with_cell_file(cell, "T6-602S", *lines) as named:
            first_run(named)


@pytest.mark.soak
def test_a_controller_that_scales_all_speeds_is_in_it():
    with touched("needle-beams.toml", robot="GX8-C652S") as cell:
        on(cell, "GX8-C652S")
        cell.simulator.machine.settings.speed_factor = 50
        first_run(cell)


@pytest.mark.soak
def test_a_controller_that_does_not_tell_its_model_says_what_is_left_out(monkeypatch):
    monkeypatch.setattr(EpsonLink, "model", lambda _link: None)
    with touched("needle-beams.toml", robot="GX8-C652S") as cell:
        said, _ = first_run(on(cell, "GX8-C652S"), left_out=5)
        assert said["about_s"] is not None
