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
    quick, slow = (measured("needle-one-touch", ms) for ms in (0, 50))
    # While the robot moves, answers to the looks at it take no time of their own.
    waited_s = slow.took_s - quick.took_s
    assert 0.5 * slow.exchanges * 0.05 < waited_s < slow.exchanges * 0.05


@pytest.mark.soak
@pytest.mark.parametrize("answer_ms", [0, 20])
@pytest.mark.parametrize("name", CELLS)
def test_the_page_states_how_long_each_recipe_takes(name, answer_ms):
    took_s = measured(name, answer_ms).took_s
    assert took_s == pytest.approx(told()[name][answer_ms], rel=SCATTER)


@pytest.mark.parametrize(
    ("answer_ms", "most_s", "most_exchanges", "most_bytes"),
    [
        pytest.param(0, 10.0, 850, 80_000, marks=pytest.mark.soak),
        pytest.param(5, 12.0, 550, 110_000, marks=pytest.mark.soak),
        (20, 20.0, 450, 90_000),
    ],
)
def test_a_needle_on_a_plc_takes_no_longer_than_on_an_epson(
    answer_ms, most_s, most_exchanges, most_bytes
):
    took = measured("needle-beams on a PLC", answer_ms)
    assert took.took_s <= most_s
    assert took.exchanges <= most_exchanges
    assert 0 < took.traffic_bytes <= most_bytes
