"""A command's parameters, declared once: in the signature of its function.

The decorators of ``session.context`` and ``options.shared`` read it. The name of an option, its
type, whether it must be given, its default and its unit come from the parameter, so a
:class:`CliParameter` says only what is not seen there, and a type of click what else a value must
be. The parameters stand behind ``*``::

    def lift(context: CliContext, *, height_mm: Annotated[float, CliOption(help="How high")] = 5.0):

is ``--height MM``, a decimal number, 5 by default, which the help page shows.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from typing import Any, Final, Literal, NamedTuple, TypeVar, cast, get_args, get_origin

import click

from robolink_cli.console.numbers import DECIMAL
from robolink_cli.console.render import log_wanted

CommandT = TypeVar("CommandT", bound=Callable[..., Any])
Decorator = Callable[[Any], Any]

_UNITS: Final = {"_mm_s": "MM_S", "_mm": "MM", "_deg": "DEG", "_s": "S"}
"""Units by the ending of a parameter's name. The option's help shows the unit in place of the
value.
"""


class CliParameter:
    """An option or argument of a command, besides what the function's parameter says.

    A parameter that begins with an underscore is for an option that is kept elsewhere.

    Args:
        names: The names of the option where they do not follow from the parameter's.
        late: Whether it stands behind the options that all commands share.
        attributes: What else ``click.option`` or ``click.argument`` takes.
    """

    def __init__(self, *names: str, late: bool = False, **attributes: Any) -> None:  # noqa: ANN401 - click's form
        self.names, self.late, self.attributes = names, late, attributes


class CliOption(CliParameter):
    """A person types it behind its name."""


class CliArgument(CliParameter):
    """A person types it by its place."""


class _Declared(NamedTuple):
    """A parameter of a function that click is to fill."""

    name: str
    kind: Any
    marker: CliParameter
    types: tuple[click.ParamType[Any], ...]
    """The click type in its annotation, if there is one."""
    defaults: tuple[object, ...]
    """The default, if there is one."""

    def decorator(self) -> Decorator:
        """Return what adds it to a command."""
        attributes, multiple = self._typed()
        if isinstance(self.marker, CliArgument):
            attributes["required"] = not self.defaults
            if multiple:
                attributes["nargs"] = -1
            elif self.defaults and self.defaults[0] is not None:
                attributes["default"] = self.defaults[0]
            return click.argument(self.name, **attributes | self.marker.attributes)
        flag = attributes.get("is_flag", False)
        if multiple:
            attributes["multiple"] = True
        elif not self.defaults:
            attributes["required"] = True
        elif self.defaults[0] not in (None, ()) and not flag:
            attributes |= {"default": self.defaults[0], "show_default": True}
        if not flag and (metavar := self._metavar()):
            attributes["metavar"] = metavar
        names = self.marker.names or (self._option(),)
        return click.option(*names, self.name.lstrip("_"), **attributes | self.marker.attributes)

    def _typed(self) -> tuple[dict[str, Any], bool]:
        """Return how one value is read, and whether there may be several."""
        kind, multiple = _one_of(self.kind)
        multiple = multiple and "nargs" not in self.marker.attributes
        if self.types:
            return {"type": self.types[0]}, multiple
        if kind is str:
            return {}, multiple
        if kind is bool:
            return {"is_flag": True}, False
        if kind is float:
            return {"type": DECIMAL}, multiple
        if _is_path(kind):
            return {"type": click.Path(dir_okay=False, path_type=kind)}, multiple
        if get_origin(kind) is Literal:
            return {"type": click.Choice(get_args(kind))}, multiple
        return {"type": kind}, multiple

    def _option(self) -> str:
        stem = next((self.name.removesuffix(u) for u in _UNITS if self.name.endswith(u)), self.name)
        return "--" + stem.replace("_", "-")

    def _metavar(self) -> str | None:
        kind, _ = _one_of(self.kind)
        unit = next((shown for end, shown in _UNITS.items() if self.name.endswith(end)), None)
        return unit or ("N" if kind is int else "FILE" if _is_path(kind) else None)


def add_declared(
    function: Callable[..., Any],
    shared: Callable[[Callable[..., Any]], Callable[..., Any]],
    framed: Callable[..., Any] | None = None,
) -> Any:  # noqa: ANN401 - a command or what becomes one
    """Add what a function's signature declares, and the options that it shares with others.

    Args:
        function: It.
        shared: Adds the shared options.
        framed: What is called in its place, the function itself when nothing is.
    """
    declared = tuple(_declared_by(function))
    command: Any = opening_log(framed or packed(function))
    for one in reversed([one for one in declared if one.marker.late]):
        command = one.decorator()(command)
    command = shared(command)
    for one in reversed([one for one in declared if not one.marker.late]):
        command = one.decorator()(command)
    return command


def opening_log(command: CommandT) -> CommandT:
    """Return a command that opens its log, if wanted, before it does anything.

    A stop does that afterwards.

    Raises, when it is called:
        ConfigError: The file cannot be written, or what was given means nothing.
    """

    @wraps(command)
    def logged(*args: object, **given: object) -> Any:  # noqa: ANN401 - what the command returns
        context = click.get_current_context()
        wanted = log_wanted()
        if any(wanted) and context.command.name != "stop":
            from robolink_cli.options.log_file import began

            began(context.command_path, *wanted)
        return command(*args, **given)

    return cast("CommandT", logged)


def declared_options(function: Callable[..., Any]) -> Decorator:
    """Return what adds all that another function's signature declares, in order."""

    def add(command: Any) -> Any:  # noqa: ANN401 - a decorator of click
        for one in reversed(tuple(_declared_by(function))):
            command = one.decorator()(command)
        return command

    return add


def packed(function: CommandT) -> CommandT:
    """Return what takes each option by itself, and passes a function its groups of options.

    A group is a named tuple whose fields are declared as parameters are.
    """
    groups = [one for one in function.__annotations__.items() if _is_group(one[1])]
    if not groups:
        return function

    @wraps(function)
    def ungrouped(*args: object, **given: object) -> Any:  # noqa: ANN401 - what the command returns
        for name, group in groups:
            given[name] = group(**{field: given.pop(field) for field in _fields(group)})
        return function(*args, **given)

    return cast("CommandT", ungrouped)


def _declared_by(function: Callable[..., Any]) -> Iterator[_Declared]:
    defaults: dict[str, object] = function.__kwdefaults__ or {}
    for name, hint in function.__annotations__.items():
        if _is_group(hint):
            yield from _fields(hint).values()
        elif (found := _declared(name, hint, defaults)) is not None:
            yield found


def _fields(group: Any) -> dict[str, _Declared]:  # noqa: ANN401 - a class
    hints = group.__annotations__.items()
    found = (_declared(name, hint, group._field_defaults) for name, hint in hints)
    return {one.name: one for one in found if one is not None}


def _declared(name: str, hint: Any, defaults: Mapping[str, object]) -> _Declared | None:  # noqa: ANN401 - a type
    about: tuple[object, ...] = getattr(hint, "__metadata__", ())
    marker = next((one for one in about if isinstance(one, CliParameter)), None)
    if marker is None:
        return None
    types = tuple(one for one in about if isinstance(one, click.ParamType))
    default = (defaults[name],) if name in defaults else ()
    return _Declared(name, hint.__origin__, marker, types, default)


def _is_group(hint: Any) -> bool:  # noqa: ANN401 - a type
    return hasattr(hint, "_field_defaults") and bool(_fields(hint))


def _one_of(kind: Any) -> tuple[Any, bool]:  # noqa: ANN401 - a type
    """Return the type of one value, and whether the parameter holds several."""
    if get_origin(kind) is tuple:
        return get_args(kind)[0], True
    choices = [one for one in get_args(kind) if one is not type(None)]
    return (choices[0], False) if choices and get_origin(kind) is not Literal else (kind, False)


def _is_path(kind: Any) -> bool:  # noqa: ANN401 - a type
    return isinstance(kind, type) and issubclass(kind, os.PathLike)
