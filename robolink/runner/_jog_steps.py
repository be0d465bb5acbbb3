"""Jog steps as a person types them, and where they lead."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from robolink.errors import ConfigError, LimitError
from robolink.messages import tr
from robolink.model import Path, Pose, WorkBox, angle_difference_deg, describe_pose
from robolink.remedy_words import RemedyWord, remedy_word


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Limits of a run.

    Attributes:
        box: Where targets may lie, in coordinates of the frame that moves.
        speed_percent: For joint moves, in low power.
        speed_mm_s: For straight moves, in low power.
        max_jog_mm: Largest single step that a person may type.
        max_jog_deg: The same for U.
        motion_timeout_s: Longest duration of one movement before it is aborted.
    """

    box: WorkBox
    speed_percent: int = 5
    speed_mm_s: float = 20.0
    max_jog_mm: float = 5.0
    max_jog_deg: float = 5.0
    motion_timeout_s: float = 120.0


_STEP: Final = re.compile(
    r"\s*([xyzu])\s*([+-])\s*([0-9]{1,4}(?:\.[0-9]{1,3})?)"
    r"(?=[\s;xyzu]|,(?![0-9])|$)\s*[,;]?",
    re.ASCII,
)
"""Axis, sign, number; a comma before a digit is a decimal comma, any other comma separates two
steps."""

_COMMA: Final = re.compile(r"([xyzu]\s*[+-]\s*[0-9]+),([0-9])", re.ASCII)

_PLAIN: Final = str.maketrans(
    dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212", "-")
    | {chr(0xFEE0 + code): chr(code) for code in range(0x21, 0x7F)}
    | {"\u3000": " "}
)
"""Translation of minus signs of other keyboards, and of the wide letters and digits of Chinese
input methods."""

_TURNED_DEG: Final = 0.005
"""Largest change of angle that is only read-out noise, degrees."""

TYPED_AWAY_MM: Final = 1.0
"""Largest distance between a typed pose and the reported one, in mm: half of the clearance from
which the next touch is approached."""

TYPED_AWAY_DEG: Final = 1.0

_DECIMAL: Final = re.compile(r"[+-]?[0-9]{1,5}(?:\.[0-9]{1,6})?", re.ASCII)


def jog_target(here: Pose, steps: str, settings: RunSettings) -> tuple[Pose, Path]:
    """Return where typed ``steps`` lead from ``here``, and how to go there.

    Args:
        here: Where the frame is.
        steps: As they are typed, such as ``x+0.1 z-0.5``.
        settings: How large a step may be.

    Raises:
        ConfigError: The text is not a list of steps.
        LimitError: A step is too large.

    Example:
        >>> from robolink import Pose
        >>> from robolink.model import WorkBox
        >>> from robolink.runner import RunSettings, jog_target
        >>> target, _ = jog_target(Pose(300, 100, -60, 0), "x+0.1 z-0.5", RunSettings(WorkBox()))
        >>> round(target.x_mm, 3), round(target.z_mm, 3)
        (300.1, -60.5)
    """
    deltas = parse_steps(steps)
    for axis, delta in deltas.items():
        limit = settings.max_jog_deg if axis == "u" else settings.max_jog_mm
        if abs(delta) > limit:
            raise LimitError(
                tr(
                    "{axis}{delta:+g} is more than one step may be. Nothing moved.",
                    axis=axis,
                    delta=delta,
                ),
                remedy=_smaller_steps(axis, delta, limit),
            )
    target = Pose(
        here.x_mm + deltas.get("x", 0.0),
        here.y_mm + deltas.get("y", 0.0),
        here.z_mm + deltas.get("z", 0.0),
        here.u_deg + deltas.get("u", 0.0),
        *(here.v_deg, here.w_deg, here.hand, here.local, here.tool, here.posture),
    )
    # A straight move that only turns is an error in SPEL+ without ROT (docs/reference/spel.md 7.1).
    return target, Path.JOINT if "u" in deltas else Path.STRAIGHT


def _smaller_steps(axis: str, delta: float, limit: float) -> str:
    """Return what to do instead of a step that is too large."""
    if axis != "u":
        return tr("Steps of up to {limit:g} are allowed; take several.", limit=limit)
    return tr(
        "Steps of up to {limit:g} degrees are allowed. To turn by more, lifted first: {turn}.",
        limit=limit,
        turn=remedy_word(RemedyWord.TURN, turn=delta),
    )


def typed_pose(text: str, here: Pose, settings: RunSettings) -> Pose:
    """Return a pose that a person typed: X, Y, Z in mm, U and perhaps V, W in degrees.

    Args:
        text: Four numbers, or six; blanks or semicolons between them.
        here: Where the controller says that the frame is; a digit that slipped shows against it.
        settings: For the box.

    Raises:
        ConfigError: It is no pose.
        LimitError: It is not about where the frame is, or outside the box.
    """
    words = text.translate(_PLAIN).replace(";", " ").split()
    if len(words) not in (4, 6):
        raise ConfigError(
            tr("A pose is X Y Z U, or X Y Z U V W; these are {count} numbers.", count=len(words)),
            remedy=tr("For example: 250.112 199.954 -83.573 90"),
        )
    x_mm, y_mm, z_mm, *angles = map(parse_decimal, words)
    u_deg, v_deg, w_deg = (*angles, here.v_deg, here.w_deg)[:3] if len(angles) == 1 else angles
    typed = replace(here, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm, u_deg=u_deg, v_deg=v_deg, w_deg=w_deg)
    away_mm = math.dist(typed.coordinates()[:3], here.coordinates()[:3])
    apart = zip(typed.coordinates()[3:], here.coordinates()[3:], strict=True)
    away_deg = max(abs(angle_difference_deg(one, other)) for one, other in apart)
    if away_mm > TYPED_AWAY_MM or away_deg > TYPED_AWAY_DEG:
        raise LimitError(
            tr(
                "That is {mm:.2f} mm and {deg:.1f} degrees from where the controller has the tool.",
                mm=away_mm,
                deg=away_deg,
            ),
            remedy=tr(
                "robolink did not record it. Type one within {mm:g} mm and {deg:g} degrees.",
                mm=TYPED_AWAY_MM,
                deg=TYPED_AWAY_DEG,
            ),
        )
    settings.box.check(typed)
    return typed


def way_in_words(before: Pose, after: Pose) -> str:
    """Report that a jog is done, how far it went (measured), and where the tool is now.

    Args:
        before: Where it was, mm and degrees.
        after: Where it is.
    """
    way_mm = math.dist(before.coordinates()[:3], after.coordinates()[:3])
    turned_deg = angle_difference_deg(after.u_deg, before.u_deg)
    where = describe_pose(after)
    if abs(turned_deg) < _TURNED_DEG:
        return tr("  done: moved {way:.3f} mm. Now at {where}", way=way_mm, where=where)
    return tr(
        "  done: moved {way:.3f} mm and turned {turned:+.3f} degrees. Now at {where}",
        way=way_mm,
        turned=turned_deg,
        where=where,
    )


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

    Blanks may stand anywhere between them, and minus signs and letters may be those of any
    keyboard: ``x + 0.1``. The sign is never left out, because a number without one may be meant as
    a position. A decimal comma is refused: a comma also parts two steps.

    Raises:
        ConfigError: Anything else, or an axis twice.
    """
    return dict(_read_steps(text))


@lru_cache(maxsize=64)
def _read_steps(text: str) -> Mapping[str, float]:
    """Read steps; the same text is read where it is checked, carried out and counted."""
    refuse_decimal_comma(text)
    plain = _narrow(text)
    deltas: dict[str, float] = {}
    at = 0
    while at < len(plain):
        match = _STEP.match(plain, at)
        if match is None:
            raise _no_step(plain[at:].strip())
        axis, sign, number = match.groups()
        if axis in deltas:
            raise ConfigError(
                tr("{axis} appears twice. Nothing moved.", axis=axis),
                remedy=tr(
                    "Give each axis once, for example x+0.1 z-0.5, and the rest in the next step."
                ),
            )
        deltas[axis] = float(sign + number)
        at = match.end()
    if not deltas:
        raise ConfigError(tr("No jog step was given."), remedy=tr("For example: x+0.1 z-0.5"))
    return deltas


def refuse_decimal_comma(text: str) -> None:
    """Refuse jog steps with decimal commas: a comma also separates two steps.

    Raises:
        ConfigError: A number has one; the sentence says how to write it.

    Example:
        >>> from robolink.runner import refuse_decimal_comma
        >>> refuse_decimal_comma("x+0.1, z-0.5")  # it parts two steps here
    """
    plain = _narrow(text)
    if "," not in plain:
        return
    pointed = _COMMA.sub(r"\1.\2", plain)
    if pointed != plain:
        raise ConfigError(
            tr("Write the decimal point as '.': {step}. Nothing moved.", step=pointed),
            remedy=tr("For example: x+0.1 z-0.5"),
        )


def _narrow(text: str) -> str:
    return text.translate(_PLAIN).lower().strip()


def _no_step(word: str) -> ConfigError:
    return ConfigError(
        tr("{word!r} is not a step. A step is x+0.1: axis, sign, number, with a point.", word=word),
        remedy=tr("Nothing moved. Type steps along x, y, z or u, for example x+0.1 z-0.5."),
    )
