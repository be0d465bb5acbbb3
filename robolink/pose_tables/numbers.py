"""Numbers as files hold them: one strict form, and what is said of what only looks like one.

A number is ASCII digits with a point, a sign and an exponent at most. A minus sign of typesetting
and full-width digits of an input method are the same characters to whoever typed them, and are read
as such; a letter O, a comma or stars are not.
"""

import math
import re
from typing import Final

from robolink.messages import tr

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
    """Tell whether a word is a number or a damaged one: digits with letters like digits, stars."""
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
