"""Parameters of a kinematics as text, from a URL or a command line."""

from collections.abc import Mapping

from robolink.errors import ConfigError
from robolink.messages import tr


def parameters_from_text(pairs: Mapping[str, str]) -> dict[str, float]:
    """Return the parameters as numbers; names and ranges are checked where a machine is made.

    Raises:
        ConfigError: A value is no decimal number.
    """
    return {name: _number(name, text) for name, text in pairs.items()}


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(
            tr("The parameter {name} cannot be {value!r}.", name=name, value=text),
            remedy=tr("Give a decimal number, for example {name}=250.5.", name=name),
        ) from error
