"""recalibrate RECIPE.toml: the scripted nozzle change."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import json_is_on
from robolink_cli.options.consent import DryRun, Plain, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import TYPED
from robolink_cli.session.completion import complete_recipe
from robolink_cli.session.context import CliContext, optional_controller
from robolink_cli.session.operator_identity import Lot, Nozzle
from robolink_cli.session.order import OrderId, require_no_dry_run

if TYPE_CHECKING:
    from robolink.recipe import Answers, LoadedRecipe, Recipe
    from robolink_cli.wizard.state import Header


_NUMBERED = re.compile(r"([0-9]{1,3})=(.+)", re.ASCII | re.DOTALL)


AnswerTexts = Annotated[
    tuple[str, ...],
    CliOption(
        "--answer",
        metavar="N=TEXT",
        help="Answer to prompt N of the recipe, counted from 1.",
    ),
]

TypedHeights = Annotated[
    tuple[str, ...],
    CliOption(
        metavar="TOOL=MM",
        help='Z of a new tip in mm from the flange, for a recipe with z = "typed".',
    ),
]


def answers_from(
    recipe: "Recipe",
    *,
    texts: tuple[str, ...],
    z_mm: tuple[str, ...],
    nozzle: str | None,
    lot: str | None,
    yes: bool,
) -> "Answers":
    """Return the answers in the options.

    Raises:
        ConfigError: An answer to nothing that the recipe asks, or one that is no answer.
    """
    from robolink.recipe import Answers
    from robolink.runner import parse_decimal

    tools = {tool.number for tool in recipe.tools}
    heights = {number: parse_decimal(text) for number, text in _pairs(z_mm, "--z").items()}
    if heights and (recipe.z != "typed" or not heights.keys() <= tools):
        raise ConfigError(
            tr("The recipe does not ask for Z of tool {tool}.", tool=next(iter(heights))),
            remedy=tr('--z is for the tools of a recipe with z = "typed".'),
        )
    answers = _pairs(texts, "--answer")
    for number in answers:
        if not 1 <= number <= len(recipe.prompts) or recipe.prompts[number - 1].answer != "text":
            raise ConfigError(
                tr("Prompt {number} of the recipe asks for no text.", number=number),
                remedy=tr('--answer is for prompts with answer = "text"; count from 1.'),
            )
    return Answers(yes=yes, nozzle=nozzle or "", lot=lot or "", texts=answers, z_mm=heights)


def _pairs(texts: tuple[str, ...], option: str) -> dict[int, str]:
    found: dict[int, str] = {}
    for text in texts:
        match = _NUMBERED.fullmatch(text)
        if match is None or int(match[1]) in found:
            raise ConfigError(
                tr("{option} {text!r} is not NUMBER=VALUE, once each.", option=option, text=text),
                remedy=tr("For example --answer 2=checked, or --z 1=-120.35."),
            )
        found[int(match[1])] = match[2].strip()
    return found


Sensor = Annotated[
    str | None,
    CliOption(
        metavar="NAME|URL",
        help="The camera: a plug-in's name or URL, or a simulator's assist or sim URL.",
    ),
]


_STEPS: Final = 7
"""Number of steps in the first row: choose, check, approach, touch, fit, new values, turn test."""


@click.command()
@optional_controller
def recalibrate(
    context: CliContext,
    *,
    recipe: Annotated[
        Path | None, CliArgument(metavar="RECIPE.toml", shell_complete=complete_recipe)
    ] = None,
    reference: Annotated[
        bool, CliOption(help="Measure and record a reference for differences; writes nothing.")
    ] = False,
    accepted_change_mm: Annotated[
        float | None,
        NumberInside(min=0, min_open=True),
        CliOption(
            "--accept-jump",
            help="Accept a change up to MM this time, beyond the recipe's limit; for engineers.",
        ),
    ] = None,
    assist: Annotated[
        str | None,
        CliOption(
            metavar="URL",
            help="A simulator's assist or sim URL: its simulated operator jogs the tip "
            "onto the pin.",
        ),
    ] = None,
    sensor: Sensor = None,
    jsonl: Annotated[
        bool,
        CliOption(help="One JSON line on stdout for every event; the last is the result or error."),
    ] = False,
    answers: AnswerTexts = (),
    z_mm: TypedHeights = (),
    nozzle: Nozzle = None,
    lot: Lot = None,
    order: OrderId = None,
    dry_run: DryRun = False,
    yes: Yes = False,
    _plain: Plain = False,
) -> None:
    """Change a nozzle by a recipe: measure, propose, write, test, record.

    robolink measures all tools of the recipe before it writes one; it writes all or none. After a
    refusal, Ctrl-C or an emergency stop the old values and the selected tool stay. Without RECIPE,
    on a terminal, you choose cell and recipe from lists.
    """
    from robolink_cli.commands.measure.recalibration import Recalibration, RunOptions
    from robolink_cli.commands.measure.recipe_choice import nobody_to_ask
    from robolink_cli.commands.measure.run_events import EventStream
    from robolink_cli.console.person import may_be_guided
    from robolink_cli.console.render import note
    from robolink_cli.session.context import guided_if_alone

    if recipe is None and not may_be_guided():
        raise nobody_to_ask()
    require_no_dry_run(order, dry_run=dry_run)
    events = EventStream(click.get_current_context(), on=jsonl)
    reached: list[CliContext] = []

    def told(at: CliContext, loaded: "LoadedRecipe") -> "tuple[CliContext, LoadedRecipe]":
        reached.append(at)
        for sentence in loaded.notes:
            note(sentence)
        return at, loaded

    def change() -> None:
        at, loaded = told(*_chosen(context, recipe))
        prepared = answers_from(
            loaded.recipe, texts=answers, z_mm=z_mm, nozzle=nozzle, lot=lot, yes=yes
        )
        options = RunOptions(
            prepared,
            assist_url=assist,
            take_reference=reference,
            accepted_change_mm=accepted_change_mm,
            sensor=sensor,
            order=order,
            dry_run=dry_run,
        )
        Recalibration(at, loaded, options, events).run()

    def another() -> None:
        # The typed needle and consent were for the previous tool and do not apply to the next.
        at, loaded = told(*_chosen_anew(reached[-1]))
        nothing = answers_from(loaded.recipe, texts=(), z_mm=(), nozzle=None, lot=None, yes=False)
        Recalibration(at, loaded, RunOptions(nothing), events).run()

    with events.closing():
        # An order comes from a program, even if the program has a terminal.
        alone = recipe is None or (assist is None and not dry_run and order is None)
        job = tr("Change needle")
        # A program that reads the output waits for one result.
        following = None if jsonl or json_is_on() else another
        guided_if_alone(context, change, job=job, alone=alone, following=following, steps=_STEPS)


def _chosen(context: CliContext, recipe: Path | None) -> "tuple[CliContext, LoadedRecipe]":
    """Let a person choose cell and recipe, as far as the command line does not name them."""
    from robolink.recipe import load_recipe
    from robolink_cli.commands.measure.recipe_choice import choose_recipe, context_at_desk
    from robolink_cli.prompts.current_desk import current_desk
    from robolink_cli.session.context import header_of

    named = None if recipe is None else load_recipe(recipe)
    at = context_at_desk(context, declared("Change needle"), steps=_STEPS)
    desk = current_desk()

    def head(*chosen: str, steps: int = _STEPS) -> "Header":
        return header_of(at, tr("Change needle"), *chosen, steps=steps)

    if named is not None:
        if desk is not None:
            desk.regard(head(steps=steps_of(named)))
        return at, named
    assert desk is not None  # noqa: S101 - checked by the caller
    loaded = choose_recipe(desk, at.cell, at.url, head=head)
    desk.regard(head(*_as_typed(loaded.path), steps=steps_of(loaded)))
    return at, loaded


def _chosen_anew(before: CliContext) -> "tuple[CliContext, LoadedRecipe]":
    """Let a person choose cell and recipe for the next tool, the last cell marked."""
    from robolink_cli.commands.measure.recipe_choice import choose_cell, choose_recipe
    from robolink_cli.prompts.current_desk import current_desk
    from robolink_cli.session.context import context_of_cell, header_of

    desk = current_desk()
    assert desk is not None  # noqa: S101 - it is offered at a desk alone

    def head(*typed: str, steps: int = _STEPS) -> "Header":
        return header_of(at, tr("Change needle"), *typed, anew=True, steps=steps)

    at = before
    if before.cell is not None:
        name = choose_cell(desk, head, marked=before.cell.name).name
        at = before if name == before.cell.name else context_of_cell(name, anew=True)
    loaded = choose_recipe(desk, at.cell, at.url, head=head)
    desk.regard(head("change", _as_short_as_it_goes(loaded.path), steps=steps_of(loaded)))
    return at, loaded


def steps_of(loaded: "LoadedRecipe") -> int:
    """Return how many steps of a change are numbered; the last one is the turn test.

    Args:
        loaded: The recipe.
    """
    return _STEPS if loaded.recipe.verifies else _STEPS - 1


def _as_typed(path: Path) -> tuple[str, ...]:
    """Return the shortest name to type for a chosen recipe."""
    typed = click.get_current_context().meta.get(TYPED, ())
    shown = _as_short_as_it_goes(path)
    return (shown,) if {"change", "recalibrate"} & set(typed) else ("change", shown)


def _as_short_as_it_goes(path: Path) -> str:
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
