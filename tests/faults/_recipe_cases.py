"""The disturbed runs: recipes, each on a kind of controller."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests._commands import Ended
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._recipe_cell import RecipeCell
from tests.faults._recipe_instants import Instants
from tests.faults._recipes import EXAMPLES, ON_THE_PLC, TWO_NOZZLES, TWO_ON_THE_PLC
from tests.faults._softmotion_recipe_cell import OpcuaRecipeCell, PlcRecipeCell


@dataclass(frozen=True)
class Case:
    """A recipe on a kind of controller.

    Attributes:
        kind: The kind of controller.
        recipe: The recipe.
        tools: The tools that it changes.
        answers: Options with answers; without any, a person at a terminal is asked.
    """

    kind: type[EpsonRecipeCell] | type[PlcRecipeCell]
    recipe: str
    tools: tuple[int, ...]
    answers: tuple[str, ...] = ()

    @contextmanager
    def cell(self) -> Iterator[RecipeCell]:
        """Serve a cell for the recipe."""
        cell = self.kind(self.tools)
        try:
            yield cell
        finally:
            cell.close()

    def run(self, cell: RecipeCell, folder: Path, instants: Instants) -> Ended:
        """Run it.

        Args:
            cell: The cell.
            folder: The folder for the recipe.
            instants: Sees every instant of the run.
        """
        path = folder / "recipe.toml"
        path.write_text(self.recipe)
        words = ("recalibrate", str(path), "--assist", cell.assist or cell.url, *self.answers)
        return cell.run(*words, instants=instants, asks=not self.answers)


CASES: Final = {
    "EPSON, one tool": Case(
        EpsonRecipeCell,
        (EXAMPLES / "scara-pin.toml").read_text(),
        (1,),
        ("--yes", "--nozzle", "N-7"),
    ),
    "EPSON, two tools": Case(EpsonRecipeCell, TWO_NOZZLES, (1, 2)),
    "PLC, one tool": Case(PlcRecipeCell, ON_THE_PLC, (1,), ("--yes",)),
    "PLC, two tools": Case(PlcRecipeCell, TWO_ON_THE_PLC, (1, 2)),
    "PLC over OPC UA, two tools": Case(OpcuaRecipeCell, TWO_ON_THE_PLC, (1, 2)),
}
