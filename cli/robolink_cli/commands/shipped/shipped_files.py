"""Where the shipped pages and recipes are."""

from collections.abc import Sequence
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import joined, tr

_CHECKOUT: Final = Path(__file__).parents[4]


def pages_folder() -> Path:
    """Return the folder of the pages."""
    return _folder("docs", "docs")


def recipes_folder() -> Path:
    """Return the folder of the recipes to start from."""
    return _folder("recipes", "examples/recipes")


def maps_folder() -> Path:
    """Return the folder of the register maps to start from."""
    return _folder("examples/plc-maps", "examples/plc-maps")


def recipe_schema() -> Path:
    """Return the JSON Schema of a recipe, for editors."""
    return pages_folder() / "recipe.schema.json"


def require_one_of(name: str, names: Sequence[str], missing: str, *, remedy: str) -> None:
    """Refuse a name that is none of these, and suggest similar ones.

    Args:
        name: It.
        names: All that there are.
        missing: The sentence that says that it is none of them.
        remedy: How to see them all.

    Raises:
        ConfigError: It is none.
    """
    if name in names:
        return
    near = get_close_matches(name, names, n=3) or [one for one in names if name in one][:3]
    hint = tr("Did you mean {names}?", names=", ".join(near)) if near else ""
    raise ConfigError(
        missing,
        remedy=joined(" ", filter(None, (hint, remedy))),
    )


def _folder(packaged: str, in_checkout: str) -> Path:
    """Return a folder of the wheel; a source checkout has it at its top."""
    folder = Path(str(files("robolink_cli").joinpath(packaged)))
    return folder if folder.is_dir() else _CHECKOUT / in_checkout
