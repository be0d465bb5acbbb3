"""Simulator options as text, from a URL or a command line."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.option_values import values_from_text

_NUMBERS: Final = "numbers."


def option_names() -> tuple[str, ...]:
    """Return every option; error numbers are written ``numbers.NAME``."""
    own = [field.name for field in fields(EpsonOptions) if field.name != "numbers"]
    return (*own, *(_NUMBERS + field.name for field in fields(SpelNumbers)))


def options_from_text(pairs: Mapping[str, str]) -> EpsonOptions:
    """Return the defaults with ``pairs`` applied.

    Raises:
        ConfigError: An option is unknown, or a value does not fit it.
    """
    for name in pairs:
        if name not in option_names():
            raise ConfigError(
                tr("The EPSON simulator has no option {name!r}.", name=name),
                remedy=tr("Known are: {names}.", names=", ".join(option_names())),
            )
    numbers = values_from_text(SpelNumbers, pairs, prefix=_NUMBERS)
    own = values_from_text(EpsonOptions, pairs)
    return replace(EpsonOptions(), **own, numbers=replace(SpelNumbers(), **numbers))
