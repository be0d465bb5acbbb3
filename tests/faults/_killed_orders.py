"""An order that is killed on its way, and delivered again until it is carried out."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from robolink.errors import OutcomeUnknownError
from robolink.model import EntryKind
from tests.faults._change_cell import ChangeCell
from tests.faults._change_process import NEW, OLD, ORDER
from tests.faults._epson_recipe_cell import EpsonRecipeCell

RECIPE = """
schema = "robolink/recipe/1"
name = "touch"
basis = "absolute"
z = "kept"
[source]
kind = "two-pose"
[station]
id = "PIN"
[[tools]]
number = 1
"""


def check_killed_order(cell: ChangeCell, program: str) -> None:
    """Deliver a killed order until it is carried out, and then once more."""
    tools = [1, 2] if program.startswith("two") else [1]
    cell.act()
    if cell.journal.open_markers():
        written = cell.writes()
        with pytest.raises(OutcomeUnknownError, match="recover"):
            cell.deliver(program)
        assert cell.writes() == written
        cell.recover()
    stands = all(cell.tools[tool] == NEW[tool] for tool in tools)
    assert len(list(cell.journal.entries(kinds=(EntryKind.ORDER,)))) == stands
    cell.deliver(program)
    assert cell.tools == {tool: NEW[tool] if tool in tools else OLD[tool] for tool in OLD}
    for tool in tools:
        # Each time it was made, except the last, it had been undone.
        made = cell.values_written(tool)
        assert made[0::2] == [NEW[tool]] * len(made[0::2])
        assert made[1::2] == [OLD[tool]] * len(made[1::2])
        assert len(made) in ((1,) if len(tools) == 1 else (1, 3))
    written = cell.writes()
    cell.deliver(program)
    assert cell.writes() == written
    kept = list(cell.journal.entries(kinds=(EntryKind.ORDER,)))
    assert [entry.details["order"] for entry in kept] == [ORDER]
    cell.check_all_is_settled()


def words(cell: EpsonRecipeCell, folder: Path) -> list[str]:
    """Return the command of a whole ordered change."""
    recipe = folder / "touch.toml"
    recipe.write_text(RECIPE)
    return ["change", str(recipe), "--order", ORDER, "--yes", "--json", "--assist", cell.url]


def check_delivered_again(cell: EpsonRecipeCell, words: Sequence[str]) -> None:
    """The order of a killed change is carried out once, however often it is delivered."""
    cell.come_to_rest()
    if cell.open_markers():
        moves, writes = cell.moves_begun, cell.writes()
        assert cell.run(*words).code == 6
        assert (cell.moves_begun, cell.writes()) == (moves, writes)
        assert cell.run("recover", "--yes").code == 0
    cell.simulator.machine.motors_on = True
    first = cell.run(*words)
    assert first.code == 0, first.err
    assert cell.changed() == {1}
    made, moves, writes = cell.tools(), cell.moves_begun, cell.writes()
    again = cell.run(*words)
    assert again.code == 0, again.err
    assert (cell.tools(), cell.moves_begun, cell.writes()) == (made, moves, writes)
    told = json.loads(again.out)
    assert (told["order"], told["already_done"]) == (ORDER, True)
    assert told == {**json.loads(first.out), "already_done": True}
    kept = list(cell.journal.entries(kinds=(EntryKind.ORDER,)))
    assert [entry.change for entry in kept] == [told["change"]]
    assert (cell.selected, cell.settings()) == (1, cell.settings_before)
