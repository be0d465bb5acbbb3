"""Decimal numbers as a person types them: ASCII, without the forms that only Python knows.

``float()`` reads full-width digits, ``1_0`` and numbers with blanks around them; whoever typed one
of these meant something else, or pasted it (docs/faults.md, "Numbers").
"""

import math
import re
from typing import Any, Final

import click

from robolink.messages import tr

_NUMBER: Final = re.compile(
    r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|[+-]?(?:nan|inf(?:inity)?)", re.ASCII | re.IGNORECASE
)
"""A number. NaN and infinity pass here; the code that uses the value refuses them by name."""


def decimal(text: str) -> float:
    """Return the decimal number in ``text``.

    Raises:
        ValueError: It is none.
    """
    if not _NUMBER.fullmatch(text):
        raise ValueError(repr(text))
    return float(text)


class DecimalNumber(click.ParamType[float]):
    """The type of an option that takes a decimal number."""

    name = "float"

    def convert(
        self,
        value: Any,  # noqa: ANN401 - click's form
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> float:
        """Return the number."""
        if not isinstance(value, str):
            return float(value)
        try:
            return decimal(value)
        except ValueError:
            self.fail(tr("{text!r} is not a decimal number.", text=value), param, ctx)


DECIMAL: Final = DecimalNumber()


class NumberInside(click.FloatRange):
    """The type of an option that takes a decimal number within limits, or any finite one.

    No comparison with ``nan`` holds: within limits it would pass each of them, and as a limit it
    would let everything pass.
    """

    def convert(
        self,
        value: Any,  # noqa: ANN401 - click's form
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> float:
        """Return the number."""
        number = DECIMAL.convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(tr("must be a finite number"), param, ctx)
        return self.inside(number, param, ctx)

    def inside(
        self, number: float, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return a finite number, which is within the limits."""
        inside: float = super().convert(number, param, ctx)
        return inside
