"""What acts at an assist port take and give."""

from collections.abc import Mapping
from typing import Any

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose

Answer = dict[str, object]
"""What an act gives, ready for JSON."""

Parameters = Mapping[str, Any]
"""The request, as it came in."""

_MOST = 9999
_FAR = 1_000_000


def whole_number(request: Parameters, name: str) -> int:
    """Return a parameter that is a whole number from 0 to 9999.

    Raises:
        ConfigError: It is missing, or something else.
    """
    value = request.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _MOST:
        raise ConfigError(
            tr(
                "{act} needs {name}, a whole number from 0 to 9999.",
                act=request.get("do"),
                name=name,
            ),
            remedy=tr("Give it as {example}.", example=f'"{name}": 1'),
        )
    return value


def number_in(request: Parameters, name: str) -> float:
    """Return a parameter that is a number of at most a million, either way.

    Raises:
        ConfigError: It is missing, or something else.
    """
    value = request.get(name)
    # An integer of JSON may have hundreds of digits: it is compared before it becomes a float.
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not -_FAR <= value <= _FAR:
        raise ConfigError(
            tr(
                "{act} needs {name}, a number from -1000000 to 1000000.",
                act=request.get("do"),
                name=name,
            ),
            remedy=tr("Give it as {example}.", example=f'"{name}": 1.5'),
        )
    return float(value)


def tool_number(request: Parameters) -> int | None:
    """Return the parameter ``tool``, ``None`` when it is left out."""
    return whole_number(request, "tool") if "tool" in request else None


def shown_flange(flange: Pose) -> dict[str, float]:
    """Return a flange pose as acts give it."""
    x_mm, y_mm, z_mm, u_deg, _, _ = flange.coordinates()
    return {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm, "u_deg": u_deg}
