"""Values of simulator options as text, as URLs and command lines carry them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from robolink.errors import ConfigError
from robolink.messages import known_names, tr

_TRUTH: Final = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}
MOST_OF_AN_OPTION: Final = 1e12
"""Largest value of an option: above every length, time, share or device number, and small enough
that products do not overflow.
"""


def require_known(given: Iterable[str], known: Sequence[str], *, kind: str) -> None:
    """Refuse an option that a simulator does not have.

    Args:
        given: The names that were given.
        known: Those that there are.
        kind: What is simulated, as a sentence names it: "EPSON" or "PLC".

    Raises:
        ConfigError: Names the first one that is unknown.
    """
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise ConfigError(
            tr("The {kind} simulator has no option {name!r}.", kind=kind, name=unknown[0]),
            remedy=known_names(known, unknown[0]),
        )


def values_from_text(
    options: type, pairs: Mapping[str, str], *, prefix: str = ""
) -> dict[str, Any]:
    """Return the values of those ``pairs`` that name a field of a dataclass.

    Args:
        options: The dataclass.
        pairs: Names and values.
        prefix: Stands before each name of a field.

    Raises:
        ConfigError: A value does not fit its field.
    """
    if not pairs:
        return {}
    hints = _hints(options)
    names = [field.name for field in fields(options) if prefix + field.name in pairs]
    return {name: _value(prefix + name, pairs[prefix + name], hints[name]) for name in names}


@lru_cache(maxsize=16)
def _hints(options: type) -> Mapping[str, Any]:
    return get_type_hints(options)


def _value(name: str, text: str, hint: Any) -> object:  # noqa: ANN401 - a type annotation
    if get_origin(hint) is Literal:
        for choice in get_args(hint):
            if text == str(choice):
                return choice
        raise _refused(name, text, ", ".join(str(choice) for choice in get_args(hint)))
    if hint == int | None:
        if text.lower() == "none":
            return None
        hint = int
    if hint is str:
        return text
    if hint is bool:
        if text.lower() in _TRUTH:
            return _TRUTH[text.lower()]
        raise _refused(name, text, "true, false")
    try:
        value = hint(text)
    except ValueError:
        value = -1
    if not 0 <= value <= MOST_OF_AN_OPTION:
        raise _refused(name, text, tr("a number, 0 or more"))
    return value


def _refused(name: str, text: str, allowed: str) -> ConfigError:
    return ConfigError(
        tr("The option {name} cannot be {value!r}.", name=name, value=text),
        remedy=tr("It takes: {allowed}.", allowed=allowed),
    )
