"""Options that answer a question beforehand, or say that nothing is to be changed."""

from collections.abc import Callable
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink_cli.console.output import PLAIN

F = TypeVar("F", bound=Callable[..., Any])


def dry_run_option(function: F) -> F:
    """Add ``--dry-run``."""
    return click.option(
        "--dry-run",
        is_flag=True,
        help="Show the exact requests and check the limits; read only, write nothing.",
    )(function)


def yes_option(function: F) -> F:
    """Add ``--yes``."""
    return click.option("--yes", is_flag=True, help="Answer yes to the question asked.")(function)


def plain_option(function: F) -> F:
    """Add ``--plain``."""

    def keep(context: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
        if wanted:
            context.meta[PLAIN] = True

    return click.option(
        "--plain",
        is_flag=True,
        expose_value=False,
        callback=keep,
        help=declared("Lines instead of a screen; for screen readers. Also ROBOLINK_PLAIN=1."),
    )(function)


def then_select_option(function: F) -> F:
    """Add ``--then-select``."""
    return click.option(
        "--then-select",
        type=click.IntRange(0, 15),
        metavar="NUMBER",
        help=declared(
            "The tool that the machine is to have selected in place of one that is selected and "
            "loses its definition; 0 is the flange."
        ),
    )(function)


def published_option(function: F) -> F:
    """Add ``--published``."""
    return click.option(
        "--published",
        is_flag=True,
        help="The tools as the companion program published them; works while production runs.",
    )(function)


class MotionOption(click.Option):
    """An option that says how to move."""


def motion_option(*names: str, **attributes: Any) -> Callable[[Any], Any]:  # noqa: ANN401 - click's form
    """Add an option that says how to move, as ``click.option`` does."""
    return click.option(*names, cls=MotionOption, **attributes)


def refuse_motion_options(context: click.Context) -> None:
    """Refuse options that say how to move when nothing moves.

    Raises:
        ConfigError: Names the first that was given.
    """
    for parameter in context.command.params:
        typed = context.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE
        if isinstance(parameter, MotionOption) and typed:
            raise ConfigError(
                tr("{option} says how to move, and nothing moves here.", option=parameter.opts[0]),
                remedy=tr("Leave it out; it belongs to a measurement by the robot."),
            )
