"""Options that answer a question in advance, or ask for a dry run."""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.output import PLAIN
from robolink_cli.options.declaration import CliOption

F = TypeVar("F", bound=Callable[..., Any])


DryRun = Annotated[
    bool,
    CliOption(
        late=True, help="Show the exact requests and check the limits; reads only, writes nothing."
    ),
]

Yes = Annotated[bool, CliOption(late=True, help="Answer yes to the question.")]

Overwrite = Annotated[bool, CliOption(help="Overwrite an existing file.")]

Published = Annotated[
    bool,
    CliOption(
        help="Use the tools published by the companion program; works while production runs."
    ),
]

ThenSelect = Annotated[
    int | None,
    click.IntRange(0, 15),
    CliOption(
        metavar="NUMBER",
        help="The tool to select instead when the selected tool is cleared; 0 is the flange.",
    ),
]


def _keep_plain(context: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        context.meta[PLAIN] = True


Plain = Annotated[
    bool,
    CliOption(
        "--plain",
        late=True,
        expose_value=False,
        callback=_keep_plain,
        help="Use lines instead of a screen; for screen readers. Also ROBOLINK_PLAIN=1.",
    ),
]
"""Stored for the whole command line, so commands do not take it as a parameter."""


class MotionOption(click.Option):
    """An option for how to move."""


def motion_option(*names: str, **attributes: Any) -> Callable[[Any], Any]:  # noqa: ANN401 - click's form
    """Add an option for how to move, as ``click.option`` does."""
    return click.option(*names, cls=MotionOption, **attributes)


def refuse_motion_options(context: click.Context) -> None:
    """Refuse options for how to move when nothing moves.

    Raises:
        ConfigError: Names the first that was given.
    """
    for parameter in context.command.params:
        typed = context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
        if isinstance(parameter, MotionOption) and typed:
            raise ConfigError(
                tr("{option} is for movements, and nothing moves here.", option=parameter.opts[0]),
                remedy=tr("Leave it out; use it when the robot measures."),
            )
