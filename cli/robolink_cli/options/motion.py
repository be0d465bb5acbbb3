"""Options that say how to move, and so mean nothing where nothing moves."""

from collections.abc import Callable
from typing import Any

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr


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
