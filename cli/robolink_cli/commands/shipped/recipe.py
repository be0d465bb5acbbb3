"""recipe list, new, check: recipes to begin with, and whether one is right."""

from pathlib import Path

import click

from robolink.messages import spoken, tr
from robolink_cli.commands.shipped.recipe_copies import copy_recipe, models, purpose_of
from robolink_cli.console.render import emit_json, json_is_on, say, say_listed
from robolink_cli.options.shared import json_option
from robolink_cli.session.completing import complete_recipe


@click.group()
def recipe() -> None:
    """Recipes: copy one to begin with, and check your own."""


def _complete_model(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the recipes that come with robolink whose names begin so, for TAB."""
    return [name for name in models() if name.startswith(start)]


@recipe.command("list")
@json_option
def list_models() -> None:
    """List the recipes that come with robolink, to begin with."""
    purposes = {name: purpose_of(path) for name, path in models().items()}
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

    Its numbers fit the simulated cell, and with them it runs on simulated controllers alone. Put in
    those of your own in the marked lines, delete the line 'numbers', then 'robolink recipe check
    FILE'.
    Its first line tells an editor which keys there are.
    """
    wanted = name.removesuffix(".toml")
    path = file or Path(f"{wanted}.toml")
    copy_recipe(wanted, path, replace=force)
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
