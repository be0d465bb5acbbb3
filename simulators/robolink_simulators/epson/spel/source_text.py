"""Files of a project as lines, their macros, and their errors.

What ``#define`` gives a name to (docs/reference/spel.md 1.1).

Files of a project as lines: what a person wrote, without comments, macros in their place.

Source: docs/reference/spel.md 1, 1.1; docs/reference/spel.md 16.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr


@dataclass(frozen=True, slots=True)
class SourcePlace:
    """A line of a file, counted from 1."""

    file: str
    line: int


class ProgramFault(Exception):
    """One fault.

    Attributes:
        place: The line it is in.
        column: Counted from 1, 0 where the whole line is meant. In a line with macros, of the
            line as they made it.
        text: What is wrong, without the place.
        expected: What could have stood there instead.
    """

    def __init__(
        self, place: SourcePlace, text: str, *, column: int = 0, expected: tuple[str, ...] = ()
    ) -> None:
        super().__init__(text)
        self.place = place
        self.column = column
        self.text = text
        self.expected = expected

    def __str__(self) -> str:
        where = f"{self.place.file}:{self.place.line}"
        if self.column:
            where += f":{self.column}"
        if not self.expected:
            return f"{where}: {self.text}"
        wanted = tr("expected {words}", words=", ".join(self.expected))
        return f"{where}: {self.text} ({wanted})"


class ProgramRefused(ConfigError):
    """A project that cannot be built.

    Attributes:
        faults: All that is wrong with it, at least one, in the order of the lines.
    """

    def __init__(self, faults: Iterable[ProgramFault]) -> None:
        self.faults = tuple(faults)
        super().__init__(
            tr(
                "Faults: {count}. The first: {fault}.",
                count=len(self.faults),
                fault=self.faults[0],
            ),
            remedy=tr("Correct the line that is named."),
        )


LONGEST_EXPANSION: Final = 8192
"""Most characters of a line after its macros are expanded (no limit is documented). A macro may use
its parameter twice, so thirty nested ones would fill any memory.
"""

_TOKENS: Final = re.compile(
    r'"[^"]*(?:"|$)|&[hbo][0-9a-f]+|[a-z][a-z0-9_]*\$?|.', re.IGNORECASE | re.DOTALL
)
_WORDS: Final = re.compile(r'"[^"]*"|[a-z][a-z0-9_]*\$?', re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Macro:
    """A text; where it has parameters, they are replaced by what is written in parentheses."""

    parameters: tuple[str, ...]
    text: str

    def applied(self, arguments: list[str]) -> str:
        """Return the text with its parameters replaced, wherever they stand as words."""
        given = {p.lower(): a.strip() for p, a in zip(self.parameters, arguments, strict=False)}
        return _WORDS.sub(lambda match: given.get(match[0].lower(), match[0]), self.text)


def expanded(line: str, macros: Mapping[str, Macro]) -> str:
    """Return a line with macros replaced outside of texts.

    The text of a macro holds no other macro (documented), so it is not looked at again; what
    stands in its parentheses is.

    Raises:
        OverflowError: It grows beyond :data:`LONGEST_EXPANSION`.
    """
    if not macros:
        return line
    tokens = _TOKENS.findall(line)
    if macros.keys().isdisjoint(map(str.lower, tokens)):
        return line
    written, position = list[str](), 0
    while position < len(tokens):
        macro = macros.get(tokens[position].lower())
        position += 1
        if macro is None:
            written.append(tokens[position - 1])
        elif not macro.parameters:
            written.append(macro.text)
        else:
            arguments, position = _arguments(tokens, position)
            replaced = [expanded(argument, macros) for argument in arguments]
            written.append(macro.applied(replaced))
        if sum(map(len, written)) > LONGEST_EXPANSION:
            raise OverflowError(LONGEST_EXPANSION)
    return "".join(written)


def _arguments(tokens: list[str], position: int) -> tuple[list[str], int]:
    """Return what stands between the parentheses from a position on, and where they end."""
    while position < len(tokens) and tokens[position].isspace():
        position += 1
    if position >= len(tokens) or tokens[position] != "(":
        return [], position
    depth, arguments = 0, [""]
    for index in range(position, len(tokens)):
        token = tokens[index]
        depth += (token == "(") - (token == ")")
        if depth == 0:
            return arguments, index + 1
        if token == "," and depth == 1:
            arguments.append("")
        elif index > position:
            arguments[-1] += token
    return arguments, len(tokens)


LONGEST_LINE: Final = 512
LARGEST_PROGRAM: Final = 8 * 2**20
"""Most bytes of a program's text (documented for a project, docs/reference/spel.md 16)."""

_DEEPEST_INCLUDE: Final = 8
_ENCODINGS: Final = ("utf-8-sig", "cp932", "gbk")

_ASCII: Final = 0x7F
_HALFWIDTH_KATAKANA = re.compile(r"[\uff61-\uff9f]")

_LINE_END = re.compile(r"\r\n|\n|\r")
_DIRECTIVE = re.compile(r"\s*#\s*([a-z]+)\b\s*(.*?)\s*$", re.IGNORECASE)
_NAME = re.compile(r"[a-z][a-z0-9_]*$", re.IGNORECASE)
_DEFINITION = re.compile(r"([a-z][a-z0-9_]*)(?:\(([^)]*)\))?\s*(.*)$", re.IGNORECASE)
_INCLUDED = re.compile(r'"([^"/\\]+)"$')
_CODE = re.compile(r"""((?:[^'"]|"[^"]*(?:"|$))*)""")


@dataclass(frozen=True, slots=True)
class SourceLine:
    """A line that holds something, comment and macros resolved."""

    place: SourcePlace
    text: str


def encoding_of(paths: Iterable[Path]) -> str | None:
    """Return the code page in which every file of a project can be read, if there is one.

    One PC has written them all, and a label is to be the same text in each: what is no UTF-8 may
    be read in two code pages, file by file, as different letters. What can be read in both is
    taken for GBK where code page 932 would give mostly halfwidth katakana, which Chinese text
    looks like there and Japanese programs seldom hold.

    Raises:
        ConfigError: A file cannot be read.
    """
    contents = [_content(path) for path in paths]
    fitting = [encoding for encoding in _ENCODINGS if _fits(contents, encoding)]
    if fitting[:2] == ["cp932", "gbk"]:
        letters = [c for content in contents for c in content.decode("cp932") if ord(c) > _ASCII]
        narrow = sum(_HALFWIDTH_KATAKANA.match(letter) is not None for letter in letters)
        return "gbk" if narrow > len(letters) / 2 else "cp932"
    return next(iter(fitting), None)


def _fits(contents: Iterable[bytes], encoding: str) -> bool:
    try:
        for content in contents:
            content.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def decoded(content: bytes, encoding: str | None = None) -> str:
    """Return the text of a project file.

    Args:
        content: What is in it.
        encoding: The code page of its project; without one UTF-8, code page 932 and GBK are tried,
            in this order. What is none of them is read byte by byte, since its other letters
            stand in comments, texts and labels.
    """
    for candidate in _ENCODINGS if encoding is None else (encoding,):
        try:
            return content.decode(candidate)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


@dataclass(slots=True)
class Preprocessor:
    """Turns one program file into lines.

    Attributes:
        folder: Where included files are looked for.
        encoding: The code page of the project, if one is known.
        faults: What was wrong with directives.
    """

    folder: Path
    encoding: str | None = None
    faults: list[ProgramFault] = field(default_factory=list)
    _macros: dict[str, Macro] = field(default_factory=dict)
    _branches: list[tuple[bool, bool]] = field(default_factory=list)
    _open: list[Path] = field(default_factory=list)
    _size: int = 0

    def lines(self, path: Path) -> Iterator[SourceLine]:
        """Yield the lines of a file and of what it includes.

        Raises:
            ConfigError: The file cannot be read.
        """
        yield from self._file(path, depth=0)
        if self._branches:
            place = SourcePlace(path.name, 1)
            self._blame(place, tr("An #ifdef is never closed by #endif."))
            self._branches.clear()

    def _file(self, path: Path, *, depth: int) -> Iterator[SourceLine]:
        content = _content(path)
        self._size += len(content)
        if self._size > LARGEST_PROGRAM:
            self._blame(SourcePlace(path.name, 1), tr("The program is larger than 8 MB."))
            return
        self._open.append(path)
        for place, text in _joined(path.name, decoded(content, self.encoding)):
            code = _without_comment(text)
            directive = _DIRECTIVE.match(code)
            if directive is not None:
                yield from self._directive(place, directive[1].lower(), directive[2], depth)
                continue
            if not all(holds for holds, _ in self._branches):
                continue
            if len(text) > LONGEST_LINE:
                self._blame(place, tr("The line is longer than 512 characters."))
            if code.strip() and len(code) <= LONGEST_LINE:
                yield from self._expanded(place, code.rstrip())
        self._open.pop()

    def _expanded(self, place: SourcePlace, code: str) -> Iterator[SourceLine]:
        try:
            yield SourceLine(place, expanded(code, self._macros))
        except OverflowError:
            self._blame(place, tr("With its macros the line is longer than 8192 characters."))

    def _directive(
        self, place: SourcePlace, word: str, rest: str, depth: int
    ) -> Iterator[SourceLine]:
        match word:
            case "ifdef" | "ifndef":
                defined = rest.lower() in self._macros
                self._branches.append((defined is (word == "ifdef"), False))
            case "else" | "endif":
                self._turn(place, word)
            case _ if not all(holds for holds, _ in self._branches):
                return
            case "define":
                self._define(place, rest)
            case "undef":
                self._macros.pop(rest.lower(), None)
            case "include":
                yield from self._include(place, rest, depth)
            case _:
                self._blame(place, tr("There is no directive #{word}.", word=word))

    def _turn(self, place: SourcePlace, word: str) -> None:
        if not self._branches or (word == "else" and self._branches[-1][1]):
            self._blame(place, tr("#{word} without an #ifdef.", word=word))
            return
        holds, _ = self._branches.pop()
        if word == "else":
            self._branches.append((not holds, True))

    def _define(self, place: SourcePlace, rest: str) -> None:
        match = _DEFINITION.match(rest)
        if match is None:
            self._blame(place, tr("#define needs a name."))
            return
        name, given, text = match.groups()
        parameters = tuple(p.strip() for p in given.split(",")) if given else ()
        if any(_NAME.match(parameter) is None for parameter in parameters) or len(parameters) > 8:
            self._blame(place, tr("#define takes up to 8 names in its parentheses."))
            return
        # With an empty text every occurrence of the name is deleted; for #ifdef it is defined.
        self._macros[name.lower()] = Macro(parameters, text)

    def _include(self, place: SourcePlace, rest: str, depth: int) -> Iterator[SourceLine]:
        match = _INCLUDED.match(rest)
        if match is None:
            self._blame(place, tr("#include needs the name of a file, without a path, in quotes."))
            return
        wanted = match[1].lower()
        found = [path for path in sorted(self.folder.iterdir()) if path.name.lower() == wanted]
        if not found:
            self._blame(place, tr("There is no file {name} beside it.", name=match[1]))
        elif found[0] in self._open:
            self._blame(place, tr("{name} includes itself.", name=match[1]))
        elif depth >= _DEEPEST_INCLUDE:
            self._blame(place, tr("Files include each other more than 8 deep."))
        else:
            yield from self._file(found[0], depth=depth + 1)

    def _blame(self, place: SourcePlace, text: str) -> None:
        self.faults.append(ProgramFault(place, text))


def _content(path: Path) -> bytes:
    try:
        return read_named(path, most_bytes=LARGEST_PROGRAM)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be read: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Give the file of a SPEL+ program, whose name ends in .prg."),
        ) from error


def _without_comment(text: str) -> str:
    match = _CODE.match(text)
    return text if match is None else match[1]


def _joined(name: str, text: str) -> Iterator[tuple[SourcePlace, str]]:
    """Yield lines; one that ends in a blank and an underscore goes on in the next (extension)."""
    held, first = "", 0
    for number, line in enumerate(_LINE_END.split(text), start=1):
        code = _without_comment(line).rstrip()
        first = first or number
        if code.endswith((" _", "\t_")):
            held += code[:-1]
            continue
        yield SourcePlace(name, first), held + line
        held, first = "", 0
    if held:
        yield SourcePlace(name, first), held
