"""How long the robot will take is said before it starts, and held against what it took."""

from dataclasses import replace

import pytest

from tests.contract._shipped_cells import CELLS, shipped_cell

pytestmark = pytest.mark.simulator_only

WITHIN = 0.1
"""By how much, of what it took, that may be off which was said."""


def answering(cell, answer_ms):
    """Let the controller answer after this time from now on."""
    cell.simulator.answer_s = answer_ms / 1000
    return cell


def carried_out(cell):
    """The document of one change."""
    done = cell.change(*cell.words)
    assert done.code == 0, done.err
    return done.document


def told(document):
    """What was said, held against what the robot took."""
    assert document["robot_time"]["about_s"] == pytest.approx(document["robot_s"], rel=WITHIN)
    assert document["robot_time"]["with_move_to_start"]
    return document["robot_time"]


def dry(cell, recipe=None):
    """What a dry run says, as a person reads it and as a program does."""
    of = cell if recipe is None else replace(cell, recipe=recipe)
    done = of.change("--dry-run", "--json")
    assert done.code == 0, done.err
    return done.err, done.document["robot_time"]


def test_what_is_said_is_what_the_robot_takes_however_fast_its_controller_answers(tmp_path):
    with shipped_cell("needle-beams") as cell:
        said, first = dry(cell)
        assert "not counting moves of unknown speed (5) and what you do yourself." in said
        assert (first["moves_left_out"], first["changed"], first["answer_ms"]) == (5, False, 0)
        took_s = carried_out(cell)["robot_s"]
        assert 0 < first["straight_moves_s"] < first["about_s"] < took_s
        # The way to the start is another one now: the tool stands turned.
        late = carried_out(answering(cell, 20))
        assert told(late)["earlier_runs"] == 1
        assert late["robot_time"]["answer_ms"] == 20
        assert late["robot_time"]["about_s"] > 4 + late["robot_time"]["straight_moves_s"]

        tips = cell.simulator.world.tips
        tips[1] = replace(tips[1], x_mm=tips[1].x_mm + 9)
        assert cell.change(*cell.words).code == 7
        said, now = dry(cell)
        assert "The robot needs about 14 s, not counting what you do yourself." in said
        assert now["earlier_runs"] == 2, "what ended early, or was only shown, does not count"

        faster = tmp_path / "faster.toml"
        faster.write_text(cell.recipe.read_text().replace("mm_s = 60", "mm_s = 50"))
        said, other = dry(cell, faster)
        assert (other["earlier_runs"], other["changed"]) == (0, True)
        # No run at this speed has shown how fast the joints are.
        assert other["moves_left_out"] == 5
        assert "not counting moves of unknown speed (5)" in said


def test_a_person_who_takes_a_minute_changes_nothing():
    with shipped_cell("scara-pin") as cell:
        world = cell.simulator.world
        usual = world.parameters
        world.parameters = replace(usual, person_thinks_s=60.0)
        slow = carried_out(cell)
        assert slow["took_s"] > 180
        world.parameters = usual
        quick = carried_out(cell)
        assert told(quick)["earlier_runs"] == 1
        # The first run takes its own way to the start; a person's minutes would be ten times that.
        assert slow["robot_s"] < 2 * quick["robot_s"]


@pytest.mark.soak
@pytest.mark.parametrize("answers_ms", [(0, 0), (20, 20), (50, 50), (0, 20), (20, 50)])
@pytest.mark.parametrize("name", CELLS)
def test_it_is_said_of_every_shipped_recipe_from_its_second_run_on(name, answers_ms):
    with shipped_cell(name, answers_ms[0]) as cell:
        for answer_ms in answers_ms:
            last = carried_out(answering(cell, answer_ms))
        told(last)


@pytest.mark.soak
@pytest.mark.parametrize("answers_ms", [(0, 20), (20, 0), (5, 50), (0, 50)])
@pytest.mark.parametrize("name", ["needle-beams on a PLC, two rounds", "gantry-touch-probe"])
def test_a_plc_that_answers_later_than_before_is_foreseen_too(name, answers_ms):
    """Where answers are late, the driver reads other blocks than where they come at once."""
    before_ms, now_ms = answers_ms
    with shipped_cell(name) as cell:
        carried_out(answering(cell, before_ms))
        told(carried_out(answering(cell, now_ms)))
