"""The units of our own Structured Text: types, blocks and lists, with their variables.

It reads what robolink's sources look like and nothing else; what it does not know it refuses.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

_COMMENT: Final = re.compile(r"\(\*.*?\*\)|//[^\n]*|\{[^}]*\}", re.DOTALL)
_TYPE: Final = re.compile(
    r"^TYPE (\w+) : (?:(ARRAY [^;]+);|STRUCT\n(.*?)\n\s*END_STRUCT;\n)\s*END_TYPE$",
    re.MULTILINE | re.DOTALL,
)
_BLOCK: Final = re.compile(
    r"^(FUNCTION_BLOCK|PROGRAM) (\w+)\n(.*?)^END_\1$", re.MULTILINE | re.DOTALL
)
_SECTION: Final = re.compile(
    r"^\s*(VAR\w*)( RETAIN)?\n(.*?)^\s*END_VAR\n", re.MULTILINE | re.DOTALL
)
_VARIABLE: Final = re.compile(
    r"^\s*(\w+)(?: AT (%\w+))? : ([^:;]+?)(?: := ([^;]+))?;", re.MULTILINE | re.DOTALL
)


@dataclass(frozen=True, slots=True)
class DeclaredVariable:
    """A variable of a unit.

    Attributes:
        name: As it is written.
        type: Its type, as it is written.
        address: Its address, empty for none.
        first: What it holds at first, empty for what its type says.
    """

    name: str
    type: str
    address: str = ""
    first: str = ""


@dataclass(frozen=True, slots=True)
class DeclaredType:
    """A type: an array under a name, or a structure.

    Attributes:
        name: As it is written.
        array: What it is an array of, empty for a structure.
        members: Those of a structure.
    """

    name: str
    array: str
    members: Sequence[DeclaredVariable]


@dataclass(frozen=True, slots=True)
class DeclaredBlock:
    """A function block or a program.

    Attributes:
        kind: ``FUNCTION_BLOCK`` or ``PROGRAM``.
        name: As it is written.
        sections: Kind of the section, and its variables.
        declaration: Its head as text, without END_...
        body: Its statements.
    """

    kind: str
    name: str
    sections: Sequence[tuple[str, Sequence[DeclaredVariable]]]
    declaration: str
    body: str


def types_in(text: str) -> Iterator[DeclaredType]:
    """Return the types of a text, in order."""
    for match in _TYPE.finditer(_plain(text)):
        name, array, members = match.groups()
        yield DeclaredType(name, array or "", _variables(members or ""))


def blocks_in(text: str) -> Iterator[DeclaredBlock]:
    """Return the function blocks and programs of a text, in order."""
    for match in _BLOCK.finditer(text):
        kind, name, inside = match.groups()
        sections, end = [], 0
        for section in _SECTION.finditer(inside):
            sections.append((section[1], _variables(_plain(section[3]))))
            end = section.end()
        declaration = f"{kind} {name}\n{inside[:end]}"
        yield DeclaredBlock(kind, name, sections, declaration, inside[end:].strip("\n"))


def list_in(text: str) -> Sequence[DeclaredVariable]:
    """Return the variables of a list of global variables."""
    (section,) = _SECTION.finditer(_plain(text))
    return _variables(section[3])


def _variables(text: str) -> Sequence[DeclaredVariable]:
    found = [DeclaredVariable(m[1], m[3], m[2] or "", m[4] or "") for m in _VARIABLE.finditer(text)]
    if len(found) != text.count(";"):
        raise ValueError(text)
    return found


def _plain(text: str) -> str:
    """Return a text without comments and pragmas."""
    return _COMMENT.sub("", text)
