"""Numbers as files hold them: one strict form, and sentences for near misses.

A number is ASCII digits with a point, a sign and an exponent at most. A minus sign of typesetting
and full-width digits of an input method are the same characters to whoever typed them, and are read
as such; a letter O, a comma or stars are not.
"""

import math
import re
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.questions import looks_like_metres, which_length
from robolink.pose_tables.values import (
    LengthUnit,
    OpenQuestion,
    RawTable,
    UnclearText,
    UnusableText,
)

NUMBER: Final = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
"""Pattern of a number, without groups."""

_NUMBER: Final = re.compile(NUMBER)
_NEARLY: Final = re.compile(r"[+\-]*[0-9OoIl|SB.,'_]*[0-9][0-9OoIl|SB.,'_]*(?:[eE][+-]?[0-9OIl]*)?")
_STARS: Final = re.compile(r"[-+]?[*#]{2,}\.?[*#]*")
_COMMA: Final = re.compile(r"[+-]?[0-9.']*,[0-9]+")
_SAME: Final = str.maketrans(
    {
        "\u2212": "-",
        "\uff0d": "-",
        "\uff0b": "+",
        "\uff0e": ".",
        **{chr(0xFF10 + digit): str(digit) for digit in range(10)},
    }
)


def plain(text: str) -> str:
    """Return a text with the ASCII signs and digits for those that mean the same."""
    return text if text.isascii() else text.translate(_SAME)


def number_of(text: str) -> float:
    """Return the number that a text is, ``nan`` where it is none."""
    text = plain(text.strip())
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def seems_number(text: str) -> bool:
    """Return whether a word is a number or a damaged one: digits with look-alike letters, stars."""
    text = plain(text.strip())
    return bool(_NEARLY.fullmatch(text) or _STARS.fullmatch(text))


def why_no_number(name: str, text: str) -> str:
    """Return why a text is not the number of ``name``, the second half of a sentence."""
    text = text.strip()
    if not text:
        return tr("there is no {name}", name=name)
    if _STARS.fullmatch(text):
        return tr("{name} is {text!r}: a number that did not fit", name=name, text=text)
    if _COMMA.fullmatch(plain(text)):
        return tr(
            "{name} is {text!r}: write it with a decimal point, not a comma", name=name, text=text
        )
    return tr("{name} is {text!r}, which is no number", name=name, text=text)


_FAR_M: Final = 50.0
"""Largest distance of a robot from its base, in m; larger numbers are not metres."""


def settled_length(raw: RawTable, said: str | None) -> tuple[LengthUnit, str]:
    """Return the unit, and its source: ``file``, ``format``, ``option`` or ``default``.

    Args:
        raw: What was read.
        said: The unit that a person names.

    Raises:
        UnclearText: Nobody says it, and it may be another than mm.
        UnusableText: A person names another unit than the file.
    """
    if said is not None:
        unit = _unit(said)
        if raw.stated_length and raw.length is not unit:
            why = tr("it says {length} itself, but {said} was given", length=raw.length, said=unit)
            raise UnusableText(why)
        return unit, "option"
    positions = [pose.position for pose in raw.poses]
    if raw.length is not None:
        far = any(abs(value) > _FAR_M for place in positions for value in place)
        if raw.length is LengthUnit.M and far:
            why = tr("its lengths should be metres, but are too large")
            raise UnclearText(which_length(why, [*positions, (_FAR_M * 3,)]))
        return raw.length, "file" if raw.stated_length else "format"
    if raw.unit_in_comment:
        why = tr("a comment speaks of a unit: {text!r}", text=raw.unit_in_comment)
        raise UnclearText(which_length(why, positions))
    asked = metres_question(positions)
    if asked:
        raise UnclearText(asked)
    return LengthUnit.MM, "default"


def metres_question(positions: Sequence[Sequence[float]]) -> OpenQuestion | None:
    """Return the question for the unit if numbers without one do not look like mm."""
    if not looks_like_metres(positions):
        return None
    return which_length(tr("its lengths have no unit, and do not look like mm"), positions)


def _unit(name: str) -> LengthUnit:
    try:
        return LengthUnit(name.strip().lower())
    except ValueError as error:
        raise UnusableText(
            tr("{name!r} is not a unit of length; use mm, cm, m or in", name=name)
        ) from error
