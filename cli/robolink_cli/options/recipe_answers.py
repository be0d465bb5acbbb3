"""Answers that are given with the command, for the questions of a recipe."""

import re
from typing import TYPE_CHECKING, Annotated

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.options.declaration import CliOption

if TYPE_CHECKING:
    from robolink.recipe import Answers, Recipe

_NUMBERED = re.compile(r"([0-9]{1,3})=(.+)", re.ASCII | re.DOTALL)


AnswerTexts = Annotated[
    tuple[str, ...],
    CliOption(
        "--answer",
        metavar="N=TEXT",
        help="Answer to prompt number N of the recipe, counted from 1.",
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
    """Return what the options answer.

    Raises:
        ConfigError: An answer to nothing that the recipe asks, or one that is no answer.
    """
    from robolink.recipe import Answers
    from robolink.runner import parse_decimal

    tools = {tool.number for tool in recipe.tools}
    heights = {number: parse_decimal(text) for number, text in _pairs(z_mm, "--z").items()}
    if heights and (recipe.z != "typed" or not heights.keys() <= tools):
        raise ConfigError(
            tr("The recipe asks for no Z of tool {tool}.", tool=next(iter(heights))),
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
