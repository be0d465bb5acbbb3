"""The recipes with which a change can be begun on a cell, and what is on record of them."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from robolink.recipe import LoadedRecipe, RecipePast
from robolink_cli.session.cell_recipes import recipes_for, record_of

if TYPE_CHECKING:
    from robolink.config import Cell


@dataclass(frozen=True, slots=True)
class RecipeOffer:
    """A recipe with which a change can be begun.

    Attributes:
        loaded: The recipe.
        past: What is on record of it.
    """

    loaded: LoadedRecipe
    past: RecipePast

    @property
    def name(self) -> str:
        """Its name."""
        return self.loaded.name

    @property
    def path(self) -> Path:
        """Its file."""
        return self.loaded.path

    def told(self) -> tuple[str, ...]:
        """Return what is to be read of it, in the language that is spoken."""
        return record_of(self.loaded, self.past)


def recipes_of(cell: "Cell | None") -> tuple[RecipeOffer, ...]:
    """Return the recipes of a cell, those that were used on it first; sends nothing.

    Args:
        cell: What the cell file says of it; ``None`` where there is none.
    """
    return () if cell is None else tuple(RecipeOffer(*one) for one in recipes_for(cell))
