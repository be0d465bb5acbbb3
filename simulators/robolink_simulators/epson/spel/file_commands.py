"""Statements about files and folders, and the files that points are kept in.

Copy, Del, Rename and folders, in programs and in the command window.

Source: docs/reference/spel.md 18.

The point files of a project, as RC+ writes them (docs/reference/spel.md 16).

LoadPoints, SavePoints, ImportPoints and ExportPoints (docs/reference/spel.md 5.1, 18).

A project keeps its point files by their names; only Import and Export reach the folder of files.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.model import Elbow, Hand, Posture, Wrist
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import HIGHEST_LOCAL, HIGHEST_POINT, Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.values import as_text
from robolink_simulators.epson.spel.file_folder import FileFolder
from robolink_simulators.epson.spel.session import PointFile
from robolink_simulators.epson.spel.source_text import decoded
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement, Name


def _command(count: int, act: Callable[..., None]) -> Callable[[Evaluator, KeywordStatement], str]:
    """Return a statement that does something with one or two names."""

    def go(evaluator: Evaluator, command: KeywordStatement) -> str:
        if len(command.arguments) != count:
            raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} takes {count} names")
        names = [as_text(evaluator.value(argument)) for argument in command.arguments]
        act(evaluator.session.files, *names)
        return ""

    return go


def _present(evaluator: Evaluator, command: KeywordStatement) -> str:
    """ChDir folder$, or the present folder (assumed)."""
    if not command.arguments:
        return evaluator.session.files.present + "\r\n"
    return _command(1, FileFolder.change)(evaluator, command)


FILE_COMMANDS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "copy": _command(2, FileFolder.copy),
    "del": _command(1, FileFolder.delete),
    "rename": _command(2, FileFolder.rename),
    "mkdir": _command(1, FileFolder.make),
    "rmdir": _command(1, FileFolder.remove),
    "chdir": _present,
    "chdrive": _command(1, FileFolder.change_drive),
}
"""Statement handlers by keyword."""


_BLOCK: Final = re.compile(r"([A-Za-z]+?)(\d*)\s*\{$")
_PAIR: Final = re.compile(r"([A-Za-z0-9]+)=(.*)$")
_AXES: Final = "XYZUVW"
_UNDEFINED_AXES: Final = 0b111111

Pairs = dict[str, str]


def project_text(path: Path, encoding: str | None) -> str:
    """Return the text of a file of a project.

    Raises:
        ConfigError: It cannot be read.
    """
    try:
        return decoded(read_named(path), encoding)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be read: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Give a file of the project, as RC+ has saved it."),
        ) from error


def blocks(text: str) -> Iterator[tuple[tuple[str, ...], Pairs]]:
    """Yield each innermost block: the names of what it stands in, and its own pairs."""
    names, pairs = list[str](), Pairs()
    for line in map(str.strip, text.splitlines()):
        opened, pair = _BLOCK.match(line), _PAIR.match(line)
        if opened is not None:
            names.append(opened[1])
            pairs = {}
        elif line == "}" and names:
            if pairs:
                yield tuple(names), pairs
            names.pop()
            pairs = {}
        elif pair is not None:
            pairs[pair[1]] = pair[2].strip().strip('"')


def read_points(path: Path, encoding: str | None = None) -> tuple[dict[int, Point], dict[str, int]]:
    """Return the points of a file by their numbers, and the numbers of their labels.

    A point is left out where one of its first six coordinates is marked undefined; its label names
    it all the same, since a program may fill it.

    Raises:
        ConfigError: It cannot be read, or a point makes no sense.
    """
    points, labels = dict[int, Point](), dict[str, int]()
    for names, pairs in blocks(project_text(path, encoding)):
        if names[-1] != "Point":
            continue
        try:
            number = int(pairs["nNumber"])
            point, undefined = _point(pairs), int(pairs.get("nUndefined", "0"))
        except (KeyError, ValueError) as error:
            raise _not_understood(path, str(pairs.get("nNumber", "?"))) from error
        if not 0 <= number <= HIGHEST_POINT or not 0 <= point.local <= HIGHEST_LOCAL:
            raise _not_understood(path, str(number))
        if pairs.get("sLabel"):
            labels[pairs["sLabel"]] = number
        if not undefined & _UNDEFINED_AXES:
            points[number] = point
    return points, labels


def _not_understood(path: Path, number: str) -> ConfigError:
    return ConfigError(
        tr("Point {number} of {path} cannot be read.", number=number, path=path),
        remedy=tr("Save the points again in RC+."),
    )


def _point(pairs: Pairs) -> Point:
    x, y, z, u, v, w = (float(pairs.get(f"r{axis}", "0")) for axis in _AXES)
    flags = {name: int(pairs.get(key, "0")) for name, key in _FLAGS.items()}
    posture = Posture(
        Elbow.BELOW if pairs.get("nElbow") == "2" else Elbow.ABOVE,
        Wrist.FLIP if pairs.get("nWrist") == "2" else Wrist.NO_FLIP,
        **flags,
        j1_angle_deg=float(pairs.get("rJ1Angle", "0")) or None,
        j4_angle_deg=float(pairs.get("rJ4Angle", "0")) or None,
    )
    hand = Hand.LEFT if pairs.get("nHand") == "2" else Hand.RIGHT
    return Point((x, y, z, u, v, w), hand, int(pairs.get("nLocal", "0")), posture=posture)


_FLAGS: Final = {
    "j1_flag": "nJ1Flag",
    "j2_flag": "nJ2Flag",
    "j4_flag": "nJ4Flag",
    "j6_flag": "nJ6Flag",
}


def points_text(points: Mapping[int, Point], labels: Mapping[str, int]) -> str:
    """Return a point file of some points, which :func:`read_points` reads as the same points.

    Its first line is not known beyond its beginning (docs/reference/spel.md 16).
    """
    names = {number: label for label, number in labels.items()}
    lines = ["ENVT0100", 'sVersion="2.0.0"', f"nNumberOfPoints={len(points)}"]
    for at, (number, point) in enumerate(sorted(points.items()), start=1):
        lines += [f"Point{at} {{", f"\tnNumber={number}", f'\tsLabel="{names.get(number, "")}"']
        lines += [f"\t{key}={value}" for key, value in _pairs(point).items()]
        lines.append("}")
    return "".join(line + "\r\n" for line in lines)


def _pairs(point: Point) -> dict[str, float]:
    posture = point.posture or Posture()
    return {
        "nUndefined": 0,
        **{f"r{axis}": at for axis, at in zip(_AXES, point.coordinates, strict=True)},
        "nLocal": point.local,
        "nHand": 2 if point.hand is Hand.LEFT else 1,
        "nElbow": 2 if posture.elbow is Elbow.BELOW else 1,
        "nWrist": 2 if posture.wrist is Wrist.FLIP else 1,
        **{key: getattr(posture, name) for name, key in _FLAGS.items()},
        "rJ1Angle": posture.j1_angle_deg or 0,
        "rJ4Angle": posture.j4_angle_deg or 0,
    }


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
"""Statement handlers by keyword."""
