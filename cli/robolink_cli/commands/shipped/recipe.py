"""recipe list, new, check: recipes to begin with, and whether one is right."""

from pathlib import Path

import click

from robolink.messages import spoken, tr
from robolink_cli.console.render import emit_json, json_is_on, say, say_listed
from robolink_cli.options.shared import json_option
from robolink_cli.session.completing import complete_recipe


@click.group()
def recipe() -> None:
    """Recipes: copy one to begin with, and check your own."""


def _complete_model(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the recipes that come with robolink whose names begin so, for TAB."""
    return [name for name in _models() if name.startswith(start)]


@recipe.command("list")
@json_option
def list_models() -> None:
    """List the recipes that come with robolink, to begin with."""
    from robolink_cli.commands.shipped.recipe_purposes import PURPOSES

    purposes = {name: PURPOSES.get(name) or _purpose(path) for name, path in _models().items()}
    if json_is_on():
        entries = [{"name": name, "purpose": text} for name, text in purposes.items()]
        emit_json("robolink/recipes/1", {"recipes": entries})
        return
    say_listed({name: spoken(text) for name, text in purposes.items()})
    say(tr("To begin with one: robolink recipe new NAME FILE"))


@recipe.command("new", short_help="Copy a recipe to a file of your own.")
@click.argument("name", shell_complete=_complete_model)
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path), required=False)
@click.option("--force", is_flag=True, help="Overwrite a file that is already there.")
@json_option
def new(name: str, file: Path | None, *, force: bool) -> None:
    """Copy the recipe NAME to FILE; without FILE to NAME.toml in the working folder.

    Its numbers fit the simulated cell: put in those of your own, then 'robolink recipe check FILE'.
    Its first line tells an editor which keys there are.
    """
    from robolink.files.durable import write_whole
    from robolink.files.named import require_free
    from robolink_cli.commands.shipped.shipped_files import recipe_schema, require_one_of

    models = _models()
    wanted = name.removesuffix(".toml")
    require_one_of(wanted, list(models), remedy=tr("'robolink recipe list' lists them."))
    path = file or Path(f"{wanted}.toml")
    require_free(path, replace=force)
    first, _, rest = models[wanted].read_text(encoding="utf-8").partition("\n")
    if not first.startswith("#:schema "):
        rest = f"{first}\n{rest}"
    text = f"#:schema {recipe_schema().resolve().as_uri()}\n{rest}"
    write_whole(path, text.encode(), mode=0o666)
    if json_is_on():
        emit_json("robolink/recipe-new/1", {"recipe": wanted, "path": str(path)})
    else:
        say(tr("Written: {path}", path=path))
        say(tr("Put in the numbers of your cell, then: robolink recipe check {path}", path=path))


@recipe.command("check")
@click.argument(
    "file", type=click.Path(dir_okay=False, path_type=Path), shell_complete=complete_recipe
)
@json_option
def check(file: Path) -> int:
    """Say everything that is wrong with the recipe FILE. No controller is asked."""
    from robolink.recipe import check_recipe

    problems = check_recipe(file)
    if json_is_on():
        entries = [{"where": one.where, "what": one.what} for one in problems]
        emit_json("robolink/recipe-check/1", {"ok": not problems, "problems": entries})
    elif problems:
        for one in problems:
            say(": ".join(filter(None, (one.where, one.what))))
    else:
        say(tr("The recipe {path} is right.", path=file))
    return 2 if problems else 0


def _models() -> dict[str, Path]:
    from robolink_cli.commands.shipped.shipped_files import recipes_folder

    return {path.stem: path for path in sorted(recipes_folder().glob("*.toml"))}


def _purpose(path: Path) -> str:
    """Return the first line of a recipe's comment."""
    with path.open(encoding="utf-8") as lines:
        comments = (line[1:].strip() for line in lines if line.startswith("# "))
        return next(comments, "")
