"""How long the shipped recipes take: the table of docs/recipes.md, against simulated cells."""

import pytest

from tests.contract._shipped_cells import CELLS, EXAMPLES
from tests.contract.robot_time import measured

pytestmark = pytest.mark.simulator_only

PAGE = EXAMPLES.parents[1] / "docs" / "recipes.md"
NOTHING_MOVES = {"pendant-points"}
SCATTER = 0.1
"""By how much a run may differ from the median that the page states: standoffs are drawn anew."""


def told():
    """Return the seconds of each recipe, with answers at once and after 20 ms."""
    rows = [line for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    return {
        file.strip("`").removesuffix(".toml"): {0: float(at_once), 20: float(late)}
        for file, _, at_once, late in (row for row in cells if len(row) == 4)
        if late
    }


def test_every_shipped_recipe_that_moves_a_robot_has_its_cell_and_its_seconds():
    shipped = {path.stem for path in EXAMPLES.glob("*.toml")}
    assert set(CELLS) == shipped - NOTHING_MOVES == set(told())


@pytest.mark.soak
def test_a_change_waits_for_the_answers_of_most_of_its_requests():
    (quick_s, *_), (slow_s, exchanges, _) = (measured("needle-one-touch", ms) for ms in (0, 50))
    # While the robot moves, answers to the looks at it take no time of their own.
    assert 0.5 * exchanges * 0.05 < slow_s - quick_s < exchanges * 0.05


@pytest.mark.soak
@pytest.mark.parametrize("answer_ms", [0, 20])
@pytest.mark.parametrize("name", CELLS)
def test_the_page_states_how_long_each_recipe_takes(name, answer_ms):
    took_s, *_ = measured(name, answer_ms)
    assert took_s == pytest.approx(told()[name][answer_ms], rel=SCATTER)
