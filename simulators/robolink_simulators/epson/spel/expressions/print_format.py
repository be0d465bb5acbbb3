"""How values print. Points and Where come from twins.

Source: docs/reference/spel.md 3.2, 3.3, 5.6; docs/reference/epson.md 3.3.
"""

import re
from collections.abc import Sequence
from typing import Final, Literal

from robolink.protocols.spel import PrintedPoint, decimal, format_point
from robolink_simulators.epson.arm.kinematics import PLAIN
from robolink_simulators.epson.arm.robots import Mechanism, RobotModel
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.expressions.values import Number, Value, out_of_range

CRLF: Final = "\r\n"
LONGEST_PRINT: Final = 256
"""Most bytes that one Print can show (docs/reference/spel.md 3.2); more is an error (assumed)."""
LONGEST_PRINT_TO: Final = 1024
"""Most bytes that one Print can send to a TCP/IP port (docs/reference/spel.md 3.2)."""

_SCARA: Final = Mechanism.SCARA  # before Python 3.12 a member of an Enum is found slowly

_EXPONENT_FROM = 1e14
_EXPONENT_BELOW = 1e-4
_MARKS = re.compile(r"([#0,]*)(?:\.([#0]*))?")


def number_text(value: Number) -> str:
    """Return a number as Print and Str$ show it.

    Integers plain, reals with 14 digits and no trailing zeros, ``1.000000E+014`` for large
    and very small ones: the rule that fits most samples of the reference
    (docs/reference/spel.md 3.2).
    """
    if isinstance(value, int):
        return str(value)
    rounded = float(f"{value:.6e}")
    if rounded == 0:
        return "0"
    if not _EXPONENT_BELOW <= abs(rounded) < _EXPONENT_FROM:
        mantissa, exponent = f"{value:.6e}".split("e")
        return f"{mantissa}E{exponent[0]}{int(exponent[1:]):03d}"
    return f"{value:.14g}"


def _printed(point: Point, model: RobotModel) -> PrintedPoint:
    posture = None if model.mechanism is _SCARA else point.posture or PLAIN
    return PrintedPoint.of(
        point.coordinates,
        hand=point.hand,
        local=point.local,
        posture=posture,
        six_axes=model.six_axes,
    )


def point_text(point: Point, options: EpsonOptions, model: RobotModel) -> str:
    """Return a point as Print shows it: ``X: -182.632 Y: ... /R /0`` after a blank.

    Six coordinates even on a SCARA (seen in a transcript); option ``point_coordinates`` shows
    four for a point that was given four.
    """
    four = options.point_coordinates == "given" and point.given <= 4 and not model.six_axes
    coordinates: Literal["six", "four"] = "four" if four else "six"
    return format_point(_printed(point, model), coordinates=coordinates)


def point_line(number: int, point: Point, model: RobotModel) -> str:
    """Return a line of PList: ``P1   = XY(  200.000, ... ) /R /0``.

    Four values on a SCARA (docs/reference/epson.md 3.3), six on a six-axis robot (assumed).
    """
    shown = point.coordinates if model.six_axes else point.coordinates[:4]
    values = ",".join(decimal(value).rjust(9) for value in shown)
    flags = " ".join(f"/{flag}" for flag in _printed(point, model).flags)
    return f"P{number:<3} = XY({values} ) {flags}"


_GAPS: Final = {"always": " ", "nothing": "", "comma": ", ", "tab": "\t"}


def joined(
    values: Sequence[Value],
    options: EpsonOptions,
    model: RobotModel,
    *,
    longest: int = LONGEST_PRINT,
) -> str:
    """Return what Print shows for its items.

    Raises:
        Refusal: It is longer than Print can show.
    """
    text = ""
    for position, value in enumerate(values):
        is_number = isinstance(value, (int, float))
        if is_number and not position and options.number_lead_blank:
            text += " "
        if position:
            text += _GAPS.get(options.comma_blank, " " if is_number else "")
        text += value_text(value, options, model)
    if len(text) > longest:
        raise out_of_range(f"Print of more than {longest} bytes")
    return text


def value_text(value: Value, options: EpsonOptions, model: RobotModel) -> str:
    """Return one item as Print shows it."""
    match value:
        case bool():
            return str(options.true_value) if value else "0"
        case str():
            return value
        case Point():
            return point_text(value, options, model)
        case _:
            return number_text(value)


def formatted(value: Number, layout: str) -> str:
    """Return a number laid out by the marks of FmtStr$: ``0 # . ,`` (docs/reference/spel.md 3.3).

    Raises:
        Refusal: The layout holds other marks; dates are not simulated.
    """
    marks = _MARKS.fullmatch(layout)
    if marks is None:
        raise SpelRefusal(RefusalKind.FORMAT, f"Unknown format {layout!r}")
    before, after = marks[1], marks[2]
    places = len(after or "")
    whole, _, fraction = f"{abs(value):.{places}f}".partition(".")
    while fraction and len(fraction) > (after or "").rfind("0") + 1 and fraction[-1] == "0":
        fraction = fraction[:-1]
    digits = whole.lstrip("0").rjust(before.count("0"), "0")
    if "," in before:
        digits = re.sub(r"(?<=\d)(?=(\d{3})+$)", ",", digits)
    point = "." if after is not None else ""
    sign = "-" if value < 0 and (digits + fraction).strip("0,") else ""
    return f"{sign}{digits}{point}{fraction}"
