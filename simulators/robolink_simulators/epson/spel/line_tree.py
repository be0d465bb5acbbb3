"""Statements that stand in programs only, as their lines have them; nothing is compiled yet.

Source: docs/reference/spel.md 4, 14. Every name is lower case.
"""

from dataclasses import dataclass

from robolink_simulators.epson.spel.tree import (
    Coordinates,
    Expression,
    Name,
    PointRange,
    Statement,
)


@dataclass(frozen=True, slots=True)
class BlockIf:
    """``If condition Then`` with nothing behind it."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class BlockElseIf:
    """``ElseIf condition Then``."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class BlockWord:
    """A word that divides or ends a block: ``else endif default send fend``."""

    word: str


@dataclass(frozen=True, slots=True)
class Select:
    """``Select value``."""

    value: Expression


@dataclass(frozen=True, slots=True)
class Case:
    """``Case value``, or ``Case < value``."""

    value: Expression
    sign: str = "="


@dataclass(frozen=True, slots=True)
class ForLoop:
    """``For variable = start To end [Step step]``."""

    variable: Name
    start: Expression
    end: Expression
    step: Expression | None


@dataclass(frozen=True, slots=True)
class NextPass:
    """``Next [variable]``."""

    variable: str | None


@dataclass(frozen=True, slots=True)
class LoopEdge:
    """``Do`` or ``Loop`` (``word``), with ``while`` or ``until`` and a condition, or neither."""

    word: str
    test: str | None = None
    condition: Expression | None = None


@dataclass(frozen=True, slots=True)
class Parameter:
    """What a function takes; an array is always taken by reference."""

    name: str
    type_name: str
    by_reference: bool
    array: bool


@dataclass(frozen=True, slots=True)
class FunctionHeader:
    """``Function name(parameters) As type``; ``spelled`` is the name as it was written."""

    name: str
    spelled: str
    parameters: tuple[Parameter, ...]
    type_name: str | None


@dataclass(frozen=True, slots=True)
class Declared:
    """One variable of a declaration: no bounds for a scalar."""

    name: str
    bounds: tuple[Expression, ...] | None


@dataclass(frozen=True, slots=True)
class Declaration:
    """``Integer a, b(10)``; ``scope`` is ``local``, ``module``, ``global`` or ``preserve``."""

    scope: str
    type_name: str
    variables: tuple[Declared, ...]


@dataclass(frozen=True, slots=True)
class Branching:
    """``goto``, ``gosub``, ``return``, and ``exit do``, ``exit for``, ``exit function``."""

    word: str
    label: str | None = None


@dataclass(frozen=True, slots=True)
class OnError:
    """``OnErr GoTo label``; no label for ``OnErr GoTo 0``."""

    label: str | None


@dataclass(frozen=True, slots=True)
class ErrorResume:
    """``EResume``, ``EResume Next`` (``following``) or ``EResume label``."""

    label: str | None = None
    following: bool = False


@dataclass(frozen=True, slots=True)
class Call:
    """A function called as a statement; ``explicit`` with the word Call."""

    name: str
    arguments: tuple[Expression, ...]
    explicit: bool


@dataclass(frozen=True, slots=True)
class AssignElement:
    """``name(subscripts) = value``."""

    name: str
    subscripts: tuple[Expression, ...]
    value: Expression | Coordinates


@dataclass(frozen=True, slots=True)
class Redim:
    """``Redim [Preserve] name(bounds)``."""

    name: str
    bounds: tuple[Expression, ...]
    keep: bool


@dataclass(frozen=True, slots=True)
class ChannelStatement:
    """A statement about a port or a file: ``word``, its number and what follows."""

    word: str
    channel: Expression | None
    items: tuple[Expression, ...]
    role: str = ""


@dataclass(frozen=True, slots=True)
class TaskStatement:
    """A statement about tasks, locks, signals or errors."""

    word: str
    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Trap:
    """``Trap number or event[, condition] [action target]``; cancels without an action."""

    event: Expression
    condition: Expression | None
    action: str | None
    target: str | None


@dataclass(frozen=True, slots=True)
class VisionRun:
    """``VRun sequence``."""

    sequence: Expression


@dataclass(frozen=True, slots=True)
class VisionStatement:
    """VLoad, VSave, VCls, ``VCal name``, ``VSaveImage sequence, file``, ``VxCalib ...``."""

    word: str
    items: tuple[Expression, ...] = ()
    ranges: tuple[PointRange, ...] = ()


@dataclass(frozen=True, slots=True)
class VisionAccess:
    """``VGet`` or ``VSet`` (``word``): ``sequence[.object].name[(index)], items``."""

    word: str
    path: tuple[str, ...]
    index: Expression | None
    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Unsimulated:
    """A statement of SPEL+ that the simulator does not carry out."""

    word: str


LineNode = (
    BlockIf
    | BlockElseIf
    | BlockWord
    | Select
    | Case
    | ForLoop
    | NextPass
    | LoopEdge
    | FunctionHeader
    | Declaration
    | Branching
    | OnError
    | ErrorResume
    | Call
    | AssignElement
    | Redim
    | ChannelStatement
    | TaskStatement
    | Trap
    | VisionRun
    | VisionAccess
    | VisionStatement
    | Unsimulated
    | Statement
)
"""One part between the semicolons of a program line."""
