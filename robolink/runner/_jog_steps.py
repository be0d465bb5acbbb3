"""Jog steps as a person types them, and where they lead."""

import re
from dataclasses import replace

from robolink.errors import ConfigError, LimitError
from robolink.messages import tr
from robolink.model import Path, Pose
from robolink.runner._settings import RunSettings

_STEP = re.compile(r"([xyzu])([+-][0-9]{1,4}(?:\.[0-9]{1,3})?)", re.ASCII)

_DECIMAL = re.compile(r"[+-]?[0-9]{1,5}(?:\.[0-9]{1,6})?", re.ASCII)


def jog_target(here: Pose, steps: str, settings: RunSettings) -> tuple[Pose, Path]:
    """Return where typed ``steps`` lead from ``here``, and how to go there.

    Raises:
        ConfigError: The text is not a list of steps.
        LimitError: A step is too large.
    """
    deltas = parse_steps(steps)
    for axis, delta in deltas.items():
        limit = settings.max_jog_deg if axis == "u" else settings.max_jog_mm
        if abs(delta) > limit:
            raise LimitError(
                tr("{axis}{delta:+g} is too large for one step.", axis=axis, delta=delta),
                remedy=tr("Steps of up to {limit:g} are allowed; take several.", limit=limit),
            )
    target = replace(
        here,
        x_mm=here.x_mm + deltas.get("x", 0.0),
        y_mm=here.y_mm + deltas.get("y", 0.0),
        z_mm=here.z_mm + deltas.get("z", 0.0),
        u_deg=here.u_deg + deltas.get("u", 0.0),
    )
    # A straight move that only turns is an error in SPEL+ without ROT (spel.md 7.1).
    return target, Path.JOINT if "u" in deltas else Path.STRAIGHT


def parse_decimal(text: str) -> float:
    """Read a decimal number that a person typed: ``-120.35``.

    Raises:
        ConfigError: It is anything else.
    """
    if not _DECIMAL.fullmatch(text.strip()):
        raise ConfigError(
            tr("{text!r} is not a decimal number.", text=text),
            remedy=tr("Type for example -120.35."),
        )
    return float(text)


def parse_steps(text: str) -> dict[str, float]:
    """Read jog steps like ``x+0.1 y-0.05 u+5``: axis, sign, decimal number.

    Raises:
        ConfigError: Anything else, or an axis twice.
    """
    deltas: dict[str, float] = {}
    for word in text.lower().split():
        match = _STEP.fullmatch(word)
        if match is None or match[1] in deltas:
            raise ConfigError(
                tr("{word!r} is not a jog step.", word=word),
                remedy=tr(
                    "Type an axis x, y, z or u, a sign and a number, for example x+0.1 z-0.5; "
                    "ENTER when the tip is on the pin, q to end."
                ),
            )
        deltas[match[1]] = float(match[2])
    if not deltas:
        raise ConfigError(tr("No jog step was given."), remedy=tr("For example: x+0.1 z-0.5"))
    return deltas
