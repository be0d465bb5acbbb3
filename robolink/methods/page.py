"""The page of all calibration methods, made from their declarations: docs/methods.md.

``python -m robolink.methods.page`` prints it.
"""

from collections.abc import Iterator
from typing import Final, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Len, MaxLen, MinLen

from robolink.methods.method import AnyMethod
from robolink.methods.parameter_checks import ParameterField, bare, fields_of
from robolink.methods.registry import all_methods

_OPENING: Final = """\
# Calibration methods

*For integrators. Reference.*

What each method measures, what it needs, and every parameter with its limits. How to choose a
method: [calibrating a tool](calibrate.md). What else is in a recipe: [recipes](recipes.md).

    robolink calibrate n-angle --tool 1 --station PIN-07 --count 6

A method has one name. It is the NAME in `robolink calibrate NAME`, the `kind` in the `[source]`
table of a recipe, and the name of the method's module in `robolink/methods`. Its parameters are
options of the command and keys of `[source]`, with the same limits. Limits are inclusive. A value
outside them is refused before anything moves. Lengths are in mm, angles in degrees. Every command
also has `--station`, `--sigma` and the other options of its help page.

This page is made from the code: `python -m robolink.methods.page > docs/methods.md`.
"""
_STATIONS: Final = {
    "pin": "a pin",
    "beams": "two light beams",
    "touch": "a surface",
    "camera": "a camera",
}


def method_page() -> str:
    """Return the page."""
    return "\n".join([_OPENING, *(line for method in all_methods() for line in _method(method))])


def _method(method: AnyMethod) -> Iterator[str]:
    yield f"## `{method.name}`\n"
    yield f"{method.summary}\n"
    yield f"{_needs(method)}\n"
    yield "| option | key in a recipe | unit | default | limits | meaning |"
    yield "|---|---|---|---|---|---|"
    for field in fields_of(method.parameters):
        yield _row(field)
    yield ""


def _needs(method: AnyMethod) -> str:
    needs = method.needs
    measured = ", ".join(name.partition("_")[0].upper() for name in method.measures)
    told = (
        " (and Z by the height of the touch)" if method.tells_height and not method.only_z else ""
    )
    station = _STATIONS[needs.station.value]
    words = [
        "that it finds itself" if needs.finds_pin else "",
        "a robot that tilts its tool" if needs.tilt else "",
        "nothing moves" if not needs.motion else "",
    ]
    what = "; ".join([station, *filter(None, words)]).replace("; that", " that")
    return f"Measures {measured}{told}. Needs {what}."


def _row(field: ParameterField) -> str:
    option = f"`{field.option.flag or field.flag}`"
    if field.option.metavar:
        # A bar would end the table cell.
        option = f"`{field.flag} {field.option.metavar}`".replace("|", "\\|")
    key = f"`{field.name}`" if field.in_recipe else f"`{field.option.from_recipe}` at the top"
    cells = (option, key, field.unit, _default(field), _limits(field), field.help)
    return "| " + " | ".join(cells) + " |"


def _default(field: ParameterField) -> str:
    own = field.option.default_or(field.default)
    if own != field.default:
        return f"{_shown(own)}; in a recipe {_shown(field.default)}"
    return "" if field.default is None else _shown(field.default)


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return ", ".join(map(_shown, value))
    return f"{value:g}" if isinstance(value, (int, float)) else f'`"{value}"`'


def _limits(field: ParameterField) -> str:
    if get_origin(field.kind) is Literal:
        return ", ".join(f'`"{choice}"`' for choice in get_args(field.kind))
    if get_origin(field.kind) is not tuple:
        return _range(field.metadata)
    inner, limits = bare(get_args(field.kind)[0])
    each = _range(limits) if inner in (int, float) else ""
    return ", each ".join(filter(None, (_count(field), each)))


def _count(field: ParameterField) -> str:
    arguments = get_args(field.kind)
    if arguments[1:] != (Ellipsis,):
        return str(len(arguments))
    least: int = 0
    most: int | None = None
    for limit in field.metadata:
        if isinstance(limit, (Len, MinLen)):
            least = limit.min_length
        if isinstance(limit, (Len, MaxLen)):
            most = limit.max_length
    if most is None:
        return f"{least} and more"
    return str(least) if least == most else f"{least} to {most}"


def _range(metadata: tuple[object, ...]) -> str:
    low = high = ""
    for limit in metadata:
        match limit:
            case Ge(ge):
                low = f"{ge:g}"
            case Gt(gt):
                low = f"more than {gt:g}"
            case Le(le):
                high = f"{le:g}"
    if low and high:
        return f"{low} to {high}"
    return f"from {low}" if low else f"to {high}" if high else ""


if __name__ == "__main__":
    print(method_page(), end="")  # noqa: T201 - the page is made from this output
