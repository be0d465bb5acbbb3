"""LoadPoints, SavePoints, ImportPoints and ExportPoints (docs/reference/spel.md 5.1, 18).

A project keeps its point files by their names; only Import and Export reach the folder of files.
"""

from collections.abc import Callable
from typing import Final

from robolink.errors import ConfigError
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.values import as_text
from robolink_simulators.epson.spel.session import PointFile
from robolink_simulators.epson.spel.source.point_file import points_text, read_points
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement, Name

_LONGEST_NAME: Final = 32
_SUFFIX: Final = ".pts"


def _names(evaluator: Evaluator, arguments: tuple[Expression, ...], count: int) -> list[str]:
    if len(arguments) != count:
        raise SpelRefusal(RefusalKind.SYNTAX, f"Not {count} names of files")
    return [as_text(evaluator.value(argument)) for argument in arguments]


def _checked(name: str) -> str:
    """Return the name of a point file of the project, in lower case.

    Raises:
        Refusal: It has a path, a blank, or too many letters (documented).
    """
    if len(name) > _LONGEST_NAME:
        raise SpelRefusal(RefusalKind.POINT_FILE_LONG, f"{name} is too long")
    if not name or set(name) & set(' \\/:*?"<>|'):
        raise SpelRefusal(RefusalKind.POINT_FILE_NAME, f"{name!r} is no point file")
    return name.lower() if "." in name else name.lower() + _SUFFIX


def _found(evaluator: Evaluator, name: str) -> PointFile:
    kept = evaluator.session.point_files.get(_checked(name))
    if kept is None:
        raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no file {name}")
    return kept


def _load(evaluator: Evaluator, command: KeywordStatement) -> str:
    """LoadPoints file$[, Merge]: without Merge the memory is cleared first (documented)."""
    arguments = command.arguments
    merge = arguments[1:] == (Name("merge"),)
    (name,) = _names(evaluator, arguments[:1] if merge else arguments, 1)
    points, labels = _found(evaluator, name)
    table = evaluator.session.machine.points
    if not merge:
        table.clear()
    for number, point in points.items():
        table.store(number, point)
    for label, number in labels.items():
        table.label(number, label)
    return ""


def _save(evaluator: Evaluator, command: KeywordStatement) -> str:
    """SavePoints file$: the project keeps it; a file of the PC is not touched."""
    (name,) = _names(evaluator, command.arguments, 1)
    table = evaluator.session.machine.points
    points = {number: table.get(number) for number in table.numbers()}
    evaluator.session.point_files[_checked(name)] = (points, table.labels())
    return ""


def _import(evaluator: Evaluator, command: KeywordStatement) -> str:
    """ImportPoints path$, file$[, robot]: a file of the folder becomes one of the project."""
    session = evaluator.session
    if len(command.arguments) > 2:
        session.machine.numbered(evaluator.integer(command.arguments[2]))
    source, name = _names(evaluator, command.arguments[:2], 2)
    path = session.files.path(source)
    if not path.is_file():
        raise SpelRefusal(RefusalKind.NO_SUCH_FILE, f"There is no file {source}")
    try:
        read = read_points(path)
    except ConfigError as error:
        raise SpelRefusal(RefusalKind.FILE_READING, f"{source} holds no points") from error
    session.point_files[_checked(name)] = read
    return ""


def _export(evaluator: Evaluator, command: KeywordStatement) -> str:
    """ExportPoints file$, path$: a file of the project is written to the folder."""
    name, target = _names(evaluator, command.arguments, 2)
    text = points_text(*_found(evaluator, name))
    try:
        evaluator.session.files.path(target).write_bytes(text.encode("utf-8"))
    except OSError as error:
        raise SpelRefusal(RefusalKind.FILE_WRITING, f"{target}: {error.strerror}") from error
    return ""


POINT_FILE_COMMANDS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "loadpoints": _load,
    "savepoints": _save,
    "importpoints": _import,
    "exportpoints": _export,
}
"""Keyword to what carries it out."""
