"""Files to a project: every function compiled, or every error reported (docs/reference/spel.md 16).

The list of files of a project, as RC+ writes it in a .sprj file (docs/reference/spel.md 16).

Labels of inputs and outputs of a project, as RC+ writes them (docs/reference/spel.md 16).

Errors that a project defines: UserErrors.dat, as RC+ writes it (docs/reference/spel.md 16).
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.memory.bits import (
    BIT,
    BYTE,
    INPUT,
    MEMORY,
    OUTPUT,
    WORD,
    IOLabel,
)
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.expressions.values import (
    DataType,
    Variable,
    data_types,
    most_elements,
)
from robolink_simulators.epson.spel.file_commands import blocks, project_text
from robolink_simulators.epson.spel.line_tree import (
    BlockWord,
    Declaration,
    FunctionHeader,
    LineNode,
)
from robolink_simulators.epson.spel.parser import label_of, parsed
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.function_compiler import (
    FunctionCompiler,
    Line,
    bounds_of,
)
from robolink_simulators.epson.spel.programs.scope import FunctionScope
from robolink_simulators.epson.spel.programs.text_statements import FUNCTIONS_OF_ARRAYS
from robolink_simulators.epson.spel.session import UserError
from robolink_simulators.epson.spel.source_text import (
    Preprocessor,
    ProgramFault,
    ProgramRefused,
    SourceLine,
    SourcePlace,
)
from robolink_simulators.epson.spel.tasks.compiled_program import (
    CompiledFunction,
    LocalSlot,
    SpelProject,
)
from robolink_simulators.epson.spel.tree import OLD_HERE, names_in

PROJECT_SUFFIX: Final = ".sprj"


@dataclass(frozen=True, slots=True)
class ProjectFiles:
    """Files of a project.

    Attributes:
        programs: Its .prg files, in their order.
        points: Its .pts files whose points are there when a program starts.
        further_points: Those that only LoadPoints brings.
        missing_points: Names of those that are listed and not there.
    """

    programs: tuple[Path, ...]
    points: tuple[Path, ...] = ()
    further_points: tuple[Path, ...] = ()
    missing_points: tuple[str, ...] = ()


def project_files(programs: Sequence[Path], points: Sequence[Path] = ()) -> ProjectFiles:
    """Return the files that are named; in place of a .sprj file, those that it lists.

    Raises:
        ConfigError: It cannot be read, lists no program or one that is not there, or is not alone.
            A point file that is not there is told with the result: programs can be looked at
            without it.
    """
    if not any(path.suffix.lower() == PROJECT_SUFFIX for path in programs):
        return ProjectFiles(tuple(programs), tuple(points))
    if len(programs) > 1:
        raise ConfigError(
            tr("A project file lists its own programs: no other file goes with it."),
            remedy=tr("Give the .sprj file, or the .prg files."),
        )
    (project,) = programs
    listed, at_start, later, missing = list[Path](), list[Path](), list[Path](), list[str]()
    for names, pairs in blocks(project_text(project, None)):
        name = pairs.get("sName", "")
        if names == ("ProgramFile",) and name:
            path = _beside(project, name)
            if path is None:
                raise ConfigError(
                    tr("{path} lists {name}, which is not beside it.", path=project, name=name),
                    remedy=tr("Copy the whole project folder."),
                )
            listed.append(path)
        elif names == ("PointFile",) and name:
            default = pairs.get("bDefault") == "True" and pairs.get("nRobot", "1") == "1"
            path = _beside(project, name)
            if path is None:
                missing.append(name)
            else:
                (at_start if default else later).append(path)
    if not listed:
        raise ConfigError(
            tr("{path} lists no program.", path=project),
            remedy=tr("Give a project file that RC+ has saved, or the .prg files."),
        )
    return ProjectFiles(tuple(listed), (*at_start, *points), tuple(later), tuple(missing))


def _beside(project: Path, name: str) -> Path | None:
    """Return a file of the project's folder; RC+ does not tell capitals from small letters."""
    for path in sorted(project.parent.iterdir()):
        if path.name.lower() == name.lower():
            return path
    return None


_KINDS: Final = {"Input": INPUT, "Output": OUTPUT, "Memory": MEMORY}
_WIDTHS: Final = {"Bit": BIT, "Byte": BYTE, "Word": WORD}
_LABELS: Final = re.compile(r"(Input|Output|Memory)(Bit|Byte|Word)Labels$")


def read_io_labels(path: Path, encoding: str | None = None) -> dict[str, IOLabel]:
    """Return the labels of inputs, outputs and memory bits, by their names in lower case.

    Raises:
        ConfigError: It cannot be read.
    """
    labels = dict[str, IOLabel]()
    for names, pairs in blocks(project_text(path, encoding)):
        kind = _LABELS.match(names[-2]) if len(names) > 1 else None
        number = next((v for k, v in pairs.items() if k in ("nBit", "nByte", "nWord", "nPort")), "")
        name = pairs.get("sLabel", "")
        if kind is None or not name or not number.isdecimal():
            continue
        labels[name.lower()] = IOLabel(_KINDS[kind[1]], _WIDTHS[kind[2]], int(number), name)
    return labels


_FIRST: Final = 8000
_LAST: Final = 8999


def read_user_errors(path: Path, encoding: str | None = None) -> dict[str, UserError]:
    """Return the errors by their labels in lower case; one with no label or number is left out.

    Raises:
        ConfigError: It cannot be read.
    """
    errors = dict[str, UserError]()
    for _, pairs in blocks(project_text(path, encoding)):
        number, label = pairs.get("nError", ""), pairs.get("sLabel", "")
        if label and number.isdecimal() and _FIRST <= int(number) <= _LAST:
            errors[label.lower()] = UserError(int(number), pairs.get("sMessage", ""))
    return errors


LONGEST_FUNCTION_NAME: Final = 64
LONGEST_NAME: Final = 32
_BEGINS_A_FUNCTION: Final = re.compile(r"\s*function\b", re.IGNORECASE)


@dataclass(slots=True)
class _Outline:
    """A function before it is compiled."""

    header: FunctionHeader
    place: SourcePlace
    module: dict[str, Variable]
    lines: list[Line] = field(default_factory=list)
    end: SourcePlace | None = None


class ProjectBuilder:
    """Builds a project from its program files.

    Args:
        options: The controller's habits.
        labels: Names of points, inputs and outputs, ``None`` where they are not known.
        encoding: The code page of its files, ``None`` where each is looked at for itself.
    """

    def __init__(
        self,
        options: EpsonOptions,
        labels: frozenset[str] | None = None,
        encoding: str | None = None,
    ) -> None:
        self._options = options
        self._encoding = encoding
        self._labels = labels
        self._types = data_types(wraps=options.integer_overflow == "wrap")
        self._project = SpelProject()
        self._outlines: list[_Outline] = []
        self._times = Counter[SourceLine]()
        self._faults: list[ProgramFault] = []

    def build(self, files: Iterable[Path]) -> SpelProject:
        """Return the project.

        Raises:
            ProgramRefused: Something is wrong with it; all of it is told at once.
            ConfigError: A file cannot be read.
        """
        for path in files:
            self._read(path)
        for outline in self._outlines:
            self._announce(outline)
        for outline in self._outlines:
            self._compile(outline)
        if self._faults:
            raise ProgramRefused(sorted(self._faults, key=lambda f: (f.place.file, f.place.line)))
        return self._project

    def _read(self, path: Path) -> None:
        preprocessor = Preprocessor(path.parent, self._encoding)
        module: dict[str, Variable] = {}
        self._project.modules[path.name] = module
        current: _Outline | None = None
        for line in preprocessor.lines(path):
            self._project.sources[line.place] = line.text.strip()
            try:
                current = self._line(line, module, current)
            except ProgramFault as fault:
                self._faults.append(fault)
                if current is None and _BEGINS_A_FUNCTION.match(line.text):
                    # The lines that follow still count as inside: one mistake is reported once.
                    current = _Outline(FunctionHeader("", "", (), None), line.place, module)
        self._faults += preprocessor.faults
        if current is not None:
            self._faults.append(
                ProgramFault(current.place, tr("this is never closed"), expected=("Fend",))
            )

    def _line(
        self, line: SourceLine, module: dict[str, Variable], current: _Outline | None
    ) -> _Outline | None:
        """Take a line up; return the function that is open behind it."""
        label = label_of(line)
        nodes: tuple[LineNode, ...] = () if label is not None else parsed(line, self._times[line])
        self._times[line] += 1
        if self._options.old_here == "refused" and "*" in line.text and OLD_HERE in names_in(nodes):
            raise ProgramFault(line.place, tr("P* belongs to older versions: write Here"))
        if nodes and isinstance(nodes[0], FunctionHeader):
            if current is not None:
                self._faults.append(
                    ProgramFault(
                        line.place, tr("the function above is not closed"), expected=("Fend",)
                    )
                )
            current = _Outline(nodes[0], line.place, module)
            self._outlines.append(current)
            return self._inside(line.place, None, nodes[1:], current) if nodes[1:] else current
        if current is not None:
            return self._inside(line.place, label, nodes, current)
        for node in nodes:
            if not isinstance(node, Declaration):
                raise ProgramFault(
                    line.place,
                    tr("this cannot be outside functions"),
                    expected=("Function", "Global"),
                )
            self._declare(node, line.place, module)
        return None

    def _inside(
        self, place: SourcePlace, label: str | None, nodes: Sequence[LineNode], current: _Outline
    ) -> _Outline | None:
        if nodes and isinstance(nodes[-1], BlockWord) and nodes[-1].word == "fend":
            current.lines.append((place, label, nodes[:-1]))
            current.end = place
            return None
        current.lines.append((place, label, nodes))
        return current

    def _declare(self, node: Declaration, place: SourcePlace, module: dict[str, Variable]) -> None:
        function = CompiledFunction("", "", place, self._scope(module))
        emitter = Emitter(function, {}, self._options)
        for declared in node.variables:
            _check_length(declared.name, place)
            kind, life = self._types[node.type_name], node.scope
            life = "module" if life == "local" else life
            bounds = bounds_of(declared.bounds, emitter, most_elements(kind, life)) or ()
            variable = Variable(kind, bounds, life)
            if life == "module":
                module[declared.name] = variable
                continue
            known = self._project.shared.get(declared.name)
            if known is None:
                self._project.shared[declared.name] = (variable, node.scope)
            elif (known[0].kind, known[0].bounds) != (variable.kind, bounds):
                raise ProgramFault(
                    place, tr("{name} is declared twice, differently", name=declared.name)
                )

    def _scope(self, module: dict[str, Variable]) -> FunctionScope:
        undeclared: DataType | None = None
        if self._options.undeclared != "error":
            undeclared = self._types[self._options.undeclared]
        return FunctionScope(self._project, module, undeclared=undeclared, labels=self._labels)

    def _announce(self, outline: _Outline) -> None:
        """Make a function known to the others before any is compiled."""
        header, scope = outline.header, self._scope(outline.module)
        # A function without a type returns a number that nobody reads.
        kind = self._types[header.type_name or "integer"]
        function = CompiledFunction(
            header.name, header.spelled, outline.place, scope, len(header.parameters)
        )
        scope.declare(LocalSlot(header.name, kind))
        for parameter in header.parameters:
            type_ = self._types[parameter.type_name]
            scope.declare(LocalSlot(parameter.name, type_, array=parameter.array))
            function.by_reference.append(parameter.by_reference)
            function.arrays.append(parameter.array)
        function.variables = scope.variables
        if header.name in self._project.functions:
            text = tr("there is another function {name}", name=header.spelled)
            self._faults.append(ProgramFault(outline.place, text))
        if len(header.name) > LONGEST_FUNCTION_NAME:
            self._faults.append(
                ProgramFault(outline.place, tr("a function's name has up to 64 characters"))
            )
        self._project.functions.setdefault(header.name, function)

    def _compile(self, outline: _Outline) -> None:
        function = self._project.functions[outline.header.name]
        if function.place != outline.place:
            return
        compiler = FunctionCompiler(
            Emitter(function, self._project.functions, self._options, FUNCTIONS_OF_ARRAYS),
            self._types,
        )
        compiler.compile(outline.lines, outline.end or outline.place)
        self._faults += compiler.faults


def _check_length(name: str, place: SourcePlace) -> None:
    if len(name) > LONGEST_NAME:
        raise ProgramFault(place, tr("a variable's name has up to 32 characters"))


def build_project(
    files: Iterable[Path],
    options: EpsonOptions | None = None,
    *,
    labels: frozenset[str] | None = None,
    encoding: str | None = None,
) -> SpelProject:
    """Return the project in some program files; see :class:`ProjectBuilder`.

    Raises:
        ProgramRefused: Something is wrong with it.
        ConfigError: A file cannot be read.
    """
    return ProjectBuilder(options or EpsonOptions(), labels, encoding).build(files)
