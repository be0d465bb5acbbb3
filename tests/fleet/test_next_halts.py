"""A wrong recipe halts its plan by what the changes at the cells measured; a right one does not.

Each cell has thirty changes on record, with a scatter of its own.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson

import robolink
from robolink.fleet import JobState
from robolink.model import EntryKind, NewEntry, ToolOffset, plain_offset
from tests.fleet._moving_cells import NEW, RECIPE, MovingCells, PersonAtCell, teach

CHANGES = 30
WRONG_MM = 0.3
SIGMA_MM = 0.08
SCARA = Path(__file__).parents[2] / "examples/recipes/scara-pin.toml"


def changes_of(tips: list[ToolOffset]) -> list[NewEntry]:
    """Return the entries of changes of tool 1, each of which measured X and Y."""
    entries, before = [], plain_offset(None)
    for number, tip in enumerate(tips):
        change, value = f"{number:032x}", plain_offset(tip)
        said = {"method": "two-pose", "before": before, "proposed": value, "tip": value}
        measured = {**said, "measured": ["x_mm", "y_mm"]}
        written = {"before": before, "requested": value, "value": value}
        for kind, details in ((EntryKind.CALIBRATION, measured), (EntryKind.DONE, written)):
            entries.append(NewEntry(kind, change=change, operation=change, tool=1, details=details))
        before = value
    return entries


def put_on_record(url: str, tips: list[ToolOffset]) -> None:
    """Put the changes of the past on a cell's record, under the controller's own name."""
    with robolink.connect(url) as controller:
        controller.outcomes.append(*changes_of(tips))


def scattered(around: ToolOffset, random: np.random.Generator) -> ToolOffset:
    x_mm, y_mm = random.normal((around.x_mm, around.y_mm), SIGMA_MM)
    return replace(around, x_mm=round(float(x_mm), 3), y_mm=round(float(y_mm), 3))


def course(cells: MovingCells, plan, *words: str) -> tuple[list[str], list[str]]:
    """Have each cell's job carried out; return the cells that were touched, and the halts."""
    for cell in cells.simulators:
        if cells.store.progress(plan.id).standing:
            break
        ended = PersonAtCell().run(cell, *(word.format(cell=cell) for word in words))
        assert ended.code == 0, ended.err
    progress = cells.store.progress(plan.id)
    touched = [job.cell for job in progress.jobs if job.state is not JobState.WAITING]
    assert {cells.job(plan, cell).state for cell in touched} == {JobState.KEPT}
    return touched, [str(halt.rule) for halt in progress.halts]


@pytest.mark.parametrize("location", ["sqlite"], indirect=True)
@pytest.mark.parametrize("wrong", [True, pytest.param(False, marks=pytest.mark.soak)])
def test_a_recipe_that_is_wrong_everywhere_halts_its_plan(cells_of, wrong):
    """It names the points that were taught with another kind of nozzle."""
    cells, random = cells_of(*"abcdef"), np.random.default_rng(11)
    for simulator in cells.simulators.values():
        tip = scattered(NEW, random)
        teach(simulator, tip)
        teach(simulator, replace(tip, x_mm=tip.x_mm + WRONG_MM), (903, 904))
        past = [scattered(NEW, random) for _ in range(CHANGES)]
        simulator.machine.tools.set(1, past[-1])
        put_on_record(simulator.url, past)
    (cells.folder / "needle.toml").write_text(
        RECIPE.format(first=903, second=904) if wrong else RECIPE.format(first=901, second=902)
    )
    touched, halts = course(cells, cells.plan(auto=True))
    if wrong:
        assert len(touched) <= 5
        assert set(halts) <= {"shift", "spread", "same_side", "cell_unusual"}
        assert halts
    else:
        assert (touched, halts) == ([*"abcdef"], [])


@pytest.mark.soak
@pytest.mark.parametrize("location", ["sqlite"], indirect=True)
@pytest.mark.parametrize("wrong", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_robots_that_move_to_their_pins_halt_it_too(cells_of, location, tmp_path, wrong, seed):
    """All new tips sit where the recipe makes them appear: the rules see corrections alone."""
    served, random = cells_of(), np.random.default_rng(seed)
    simulators, clock = {}, ManualClock()
    try:
        for number, name in enumerate("abcdef"):
            simulator = EpsonSimulator(seed=10 * seed + number)
            url = epson.register(f"halts-{seed}-{wrong}-{name}", simulator, clock=clock)
            simulator.url = url
            simulator.world.change_nozzle(1)
            mean = simulator.world.tips[1]
            tip = scattered(mean, random)
            if wrong:
                tip = replace(tip, x_mm=tip.x_mm + WRONG_MM)
            simulator.world.tips[1] = tip
            past = [scattered(mean, random) for _ in range(CHANGES)]
            simulator.machine.tools.set(1, past[-1])
            put_on_record(url, past)
            simulators[name] = simulator
        cells = MovingCells(tmp_path, simulators, location)
        recipe = str(SCARA)
        plan = cells.plan(auto=True, recipe=recipe)
        words = ("--assist", f"epson+sim://halts-{seed}-{wrong}-{{cell}}", "--nozzle", "N-1")
        touched, halts = course(cells, plan, *words)
        moved = [name for name, one in simulators.items() if one.machine.arm.moves_started]
        assert moved == touched
        cells.store.close()
    finally:
        for name in "abcdef":
            epson.unregister(f"halts-{seed}-{wrong}-{name}")
    assert served.simulators == {}
    assert (len(touched) <= 5 and bool(halts)) if wrong else (touched, halts) == ([*"abcdef"], [])
