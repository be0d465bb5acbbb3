"""Simulator options as text, from a URL or a command line."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers

_NUMBERS: Final = "numbers."
_TRUTH: Final = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}


def option_names() -> tuple[str, ...]:
    """Return every option; error numbers are written ``numbers.NAME``."""
    own = [field.name for field in fields(EpsonOptions) if field.name != "numbers"]
    return (*own, *(_NUMBERS + field.name for field in fields(SpelNumbers)))


def options_from_text(pairs: Mapping[str, str]) -> EpsonOptions:
    """Return the defaults with ``pairs`` applied.

    Raises:
        ConfigError: An option is unknown, or a value does not fit it.
    """
    own_hints, number_hints = get_type_hints(EpsonOptions), get_type_hints(SpelNumbers)
    own: dict[str, Any] = {}
    numbers: dict[str, Any] = {}
    for name, text in pairs.items():
        if name not in option_names():
            raise ConfigError(
                tr("The EPSON simulator has no option {name!r}.", name=name),
                remedy=tr("Known are: {names}.", names=", ".join(option_names())),
            )
        if name.startswith(_NUMBERS):
            field = name.removeprefix(_NUMBERS)
            numbers[field] = _value(name, text, number_hints[field])
        else:
            own[name] = _value(name, text, own_hints[name])
    return replace(EpsonOptions(), **own, numbers=replace(SpelNumbers(), **numbers))


def _value(name: str, text: str, hint: Any) -> object:  # noqa: ANN401 - a type annotation
    if get_origin(hint) is Literal:
        for choice in get_args(hint):
            if text == str(choice):
                return choice
        raise _refused(name, text, ", ".join(str(choice) for choice in get_args(hint)))
    if hint is bool:
        if text.lower() in _TRUTH:
            return _TRUTH[text.lower()]
        raise _refused(name, text, "true, false")
    try:
        value = hint(text)
    except ValueError:
        value = -1
    if not 0 <= value < float("inf"):
        raise _refused(name, text, tr("a number from 0 up"))
    return value


def _refused(name: str, text: str, allowed: str) -> ConfigError:
    return ConfigError(
        tr("The simulator option {name} cannot be {text!r}.", name=name, text=text),
        remedy=tr("It takes: {allowed}.", allowed=allowed),
    )
