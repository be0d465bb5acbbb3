"""From a file to a recipe, or to everything that is wrong in it."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.files.toml import FileKind, Problem
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.recipe.file.recipe import Recipe


RECIPE_FILE: Final = FileKind(
    named=lambda path: tr("The recipe {path}", path=path),
    unreadable_remedy=lambda: tr(
        "docs/recipes.md shows what a recipe looks like. Nothing was sent."
    ),
    wrong_remedy=lambda: tr("Correct it; docs/recipes.md explains every key. Nothing was sent."),
)


@dataclass(frozen=True, slots=True)
class LoadedRecipe:
    """A recipe that is right, and the file it came from.

    Attributes:
        recipe: What the file says.
        path: The file.
        sha256: Hash of the bytes that were read, hexadecimal; the journal keeps it, so that a
            change of the recipe shows.
        notes: What to tell whoever wrote it: names of before, with those of now.
    """

    recipe: "Recipe"
    path: Path
    sha256: str
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What people call the recipe."""
        return self.recipe.name


def load_recipe(path: Path) -> LoadedRecipe:
    """Return the recipe in a file.

    Raises:
        ConfigError: It cannot be read, is no TOML, or is wrong; every problem is told with
            its path.
    """
    from robolink.recipe.file.former_names import with_names_of_now

    content = RECIPE_FILE.read(path)
    document, notes = with_names_of_now(RECIPE_FILE.parse(path, content))
    recipe, problems = _checked(document)
    if recipe is None or problems:
        raise RECIPE_FILE.refusal(path, problems)
    return LoadedRecipe(recipe, path, hashlib.sha256(content).hexdigest(), notes)


def check_recipe(path: Path) -> tuple[Problem, ...]:
    """Return everything that is wrong in a recipe; nothing when it is right.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return _checked(RECIPE_FILE.parse(path, RECIPE_FILE.read(path)))[1]


def _checked(document: dict[str, object]) -> tuple["Recipe | None", tuple[Problem, ...]]:
    from pydantic import ValidationError

    from robolink.recipe.checks.draft import Draft
    from robolink.recipe.checks.together import problems_together
    from robolink.recipe.file.former_names import with_names_of_now
    from robolink.recipe.file.problems import problems_of
    from robolink.recipe.file.recipe import recipe_of_all_methods

    sound: dict[str, object] = {}
    recipe, problems = None, []
    document, _ = with_names_of_now(document)
    try:
        recipe = recipe_of_all_methods().model_validate(document, context=sound)
    except ValidationError as error:
        problems = problems_of(error)
    draft = Draft.of(sound, given=document)
    return recipe, (*problems, *problems_together(draft))
