"""``recalibrate`` with an uncalibrated camera and with a held board, on both controller kinds."""

import cmath
import json
import math
import random
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.cell.camera import SimulatedBoard

from robolink.journal import memory_journal
from robolink.model import EntryKind
from tests.contract._camera_cell import cell_of, furnish, recipe_here, stored_in

pytestmark = pytest.mark.simulator_only

EXAMPLES = Path(__file__).parents[2] / "examples" / "recipes"
NOZZLE = EXAMPLES / "nozzle-and-camera.toml"
BOARD = EXAMPLES / "held-board.toml"


@pytest.fixture
def here(tmp_path, monkeypatch, capsys):
    """Opens a cell; returns it and a function that runs a recipe there."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    opened = []

    def open_cell(kind, **parameters):
        manager = cell_of(kind, seed=1)
        cell = manager.__enter__()
        opened.append(manager)
        if kind == "epson":
            cell.simulator.machine.motors_on = True
        furnish(cell, **parameters)

        def run(path, *more):
            capsys.readouterr()
            words = ("recalibrate", str(path), "--sensor", cell.url, "--yes", "--json", *more)
            code = main.run(["-c", cell.url, *words])
            shown = capsys.readouterr()
            return code, json.loads(shown.out), shown.err

        return cell, run

    yield open_cell
    for manager in opened:
        manager.__exit__(None, None, None)


@pytest.mark.parametrize(
    ("example", "kind"),
    [
        (NOZZLE, "epson"),
        (BOARD, "softmotion"),
        pytest.param(NOZZLE, "softmotion", marks=pytest.mark.soak),
        pytest.param(BOARD, "epson", marks=pytest.mark.soak),
    ],
    ids=lambda value: value if isinstance(value, str) else value.stem,
)
def test_the_example_recalibrates_inside_the_stated_interval(here, kind, example, tmp_path, capsys):
    board = example is BOARD
    cell, run = here(kind, board_held=board)
    world = cell.simulator.world
    path = example if kind == "epson" else recipe_here(cell, example, tmp_path)
    if board and kind == "softmotion":
        pair = ((20.0, 0.0), (-20.0, 0.0))
        world.board = replace(world.board, drawing_mm=pair)
        path.write_text(re.sub("fiducials_mm = .*", "spacing_mm = 40", path.read_text()))
    began_ns = cell.clock.now_ns()
    code, document, messages = run(path)
    took_s = (cell.clock.now_ns() - began_ns) / 1e9
    assert code == 0, messages
    with capsys.disabled():
        sys.stdout.write(f"\n{example.stem} recipe, {kind}: {took_s:.1f} s of robot time\n")
    (tool,) = document["tools"]
    truth = world.board.frame(cell.truth) if board else cell.truth
    found, halves = stored_in(cell), tool["fit"]["half_width95"]
    assert found is not None
    assert set(halves) == {"x_mm", "y_mm", *(["u_deg"] if board else [])}
    for name, half in halves.items():
        # The controller stores three decimals.
        assert abs(getattr(found, name) - getattr(truth, name)) <= half + 0.0005
        assert half < 0.02
    assert found.z_mm == -20.0
    assert tool["verification"]["passed"]
    kept = memory_journal(cell.url).entries(kinds=[EntryKind.STATION])
    assert len(list(kept)) == (not board)
    if not board:
        the_camera_changes(cell, run, path)


def the_camera_changes(cell, run, path):
    """The next run ends with the old value."""
    kept = stored_in(cell)
    furnish(cell, camera_um_per_px_x=21.0, camera_um_per_px_y=21.0)
    code, document, _ = run(path)
    assert (code, document["error"]["code"]) == (7, "camera_changed")
    assert stored_in(cell) == kept


def test_a_difference_carries_the_stored_value_along_with_a_board_that_turned(here, tmp_path):
    """The error that the stored value had when the points were taught stays the same."""
    cell, run = here("epson", board_held=True)
    path = tmp_path / "difference.toml"
    path.write_text(BOARD.read_text().replace('basis = "absolute"', 'basis = "difference"'))
    value, world = stored_in(cell), cell.simulator.world
    assert value is not None
    code, document, messages = run(path, "--reference")
    assert code == 0, messages
    assert stored_in(cell) == value, "the first run records the reference and writes nothing"
    before = world.board.frame(cell.truth)
    world.board = SimulatedBoard.grasped(random.Random(2))
    after = world.board.frame(cell.truth)
    code, document, messages = run(path)
    assert code == 0, messages
    turn_deg = after.u_deg - before.u_deg
    assert abs(turn_deg) > 0.5
    wrong = complex(value.x_mm - before.x_mm, value.y_mm - before.y_mm)
    still = complex(after.x_mm, after.y_mm) + wrong * cmath.exp(1j * math.radians(turn_deg))
    now = stored_in(cell)
    assert now is not None
    assert abs(complex(now.x_mm, now.y_mm) - still) < 0.012
    assert now.u_deg == pytest.approx(value.u_deg + turn_deg, abs=0.02)
    assert "turned by" in messages
    (tool,) = document["tools"]
    assert tool["verification"]["passed"]


@pytest.mark.parametrize(("example", "looks"), [(NOZZLE, 8), (BOARD, 10)])
def test_a_look_before_shows_the_plan_and_moves_nothing(here, example, looks):
    cell, run = here("epson", board_held=example is BOARD)
    code, document, messages = run(example, "--dry-run")
    assert code == 0, messages
    steps = document["steps"]
    assert sum(step["text"].startswith("Looking at") for step in steps) == looks
    assert not any(step["refusal"] for step in steps)
    assert cell.simulator.machine.arm.moves_started == 0
