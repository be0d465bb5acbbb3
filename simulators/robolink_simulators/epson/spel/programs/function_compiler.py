"""The lines of a function to its operations, by the family of each statement."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from robolink.messages import tr
from robolink_simulators.epson.condition import RefusalKind
from robolink_simulators.epson.spel.expressions.values import (
    DataType,
    elements,
    most_elements,
)
from robolink_simulators.epson.spel.line_tree import (
    AssignElement,
    Branching,
    Call,
    ChannelStatement,
    Declaration,
    ErrorResume,
    LineNode,
    OnError,
    Redim,
    TaskStatement,
    Trap,
    Unsimulated,
    VisionAccess,
    VisionRun,
    VisionStatement,
)
from robolink_simulators.epson.spel.parser import WINDOW_ONLY
from robolink_simulators.epson.spel.programs.blocks import BlockCompiler
from robolink_simulators.epson.spel.programs.channel_statements import (
    CHANNEL_STATEMENTS,
    FILE_STATEMENTS,
)
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.operations import (
    assign_element,
    assign_local,
    assign_shared,
    error_resume,
    go_back,
    go_sub,
    jump,
    jump_if,
    leave,
    on_error,
    redim,
    refuse,
)
from robolink_simulators.epson.spel.programs.task_statements import (
    TASK_STATEMENTS,
    TIMERS,
    compile_trap,
)
from robolink_simulators.epson.spel.programs.text_statements import PROCEDURES
from robolink_simulators.epson.spel.programs.vision_statements import (
    VISION_STATEMENTS,
    compile_access,
    compile_run,
)
from robolink_simulators.epson.spel.source_text import ProgramFault, SourcePlace
from robolink_simulators.epson.spel.tasks.compiled_program import JumpTarget, LocalSlot, Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.task_steps import require_advanced
from robolink_simulators.epson.spel.tree import (
    AssignPoint,
    AssignVariable,
    Binary,
    Coordinates,
    Expression,
    If,
    KeywordStatement,
    LabelledPoint,
    Name,
    PointExpression,
    Statement,
    label_in,
    modified,
)

FamilyStatement = (
    TaskStatement
    | ChannelStatement
    | Trap
    | Call
    | AssignElement
    | VisionRun
    | VisionAccess
    | VisionStatement
)

PROCEDURE_TABLES: Final = (PROCEDURES, TIMERS)
"""Tables of the statements written as a call. The first table that has the name compiles it."""

_Compiler = Callable[[Emitter, Call], Operation]


def compile_family(
    emitter: Emitter, node: FamilyStatement, target: JumpTarget | None = None
) -> Operation:
    """Return the operation of a statement that only programs know.

    Raises:
        ProgramFault: It is not known, or makes no sense.
    """
    match node:
        case Trap():
            return compile_trap(emitter, node, target)
        case VisionRun():
            return compile_run(emitter, node)
        case VisionAccess():
            return compile_access(emitter, node)
        case VisionStatement(word):
            return VISION_STATEMENTS[word](emitter, node)
        case TaskStatement(word):
            return TASK_STATEMENTS[word](emitter, node)
        case ChannelStatement(word):
            table = FILE_STATEMENTS if word in FILE_STATEMENTS else CHANNEL_STATEMENTS
            return table[word](emitter, node)
        case Call(name):
            for procedures in PROCEDURE_TABLES:
                if name in procedures:
                    return procedures[name](emitter, node)
            raise emitter.fault(tr("there is no statement and no function {name}", name=name))
        case AssignElement(name):
            raise emitter.fault(tr("nothing is called {name}", name=name))


Line = tuple[SourcePlace, str | None, Sequence[LineNode]]
"""A line: its position, its label and its statements."""


class FunctionCompiler:
    """Compiles one function.

    Args:
        emitter: Where the operations go.
        types: The types of variables by their names.
    """

    def __init__(self, emitter: Emitter, types: dict[str, DataType]) -> None:
        self._emitter = emitter
        self._types = types
        self._blocks = BlockCompiler(emitter)
        self._wanted: list[tuple[str, JumpTarget, SourcePlace]] = []
        self.faults: list[ProgramFault] = []

    def compile(self, lines: Sequence[Line], end: SourcePlace) -> None:
        """Compile the lines between Function and Fend."""
        self._declare(lines)
        for place, label, nodes in lines:
            self._emitter.begin(place)
            if label is not None:
                self._label(label)
            for node in nodes:
                self._one(node, place)
        try:
            self._blocks.finish()
        except ProgramFault as fault:
            self.faults.append(fault)
        self._emitter.begin(end)
        self._emitter.emit(leave)
        self._settle()

    def _declare(self, lines: Sequence[Line]) -> None:
        """Declare the variables first: a declaration may stand anywhere (seen)."""
        for place, _, nodes in lines:
            for node in nodes:
                if isinstance(node, Declaration):
                    self._emitter.begin(place)
                    self._guarded(self._variables, node)

    def _variables(self, node: Declaration) -> None:
        if node.scope != "local":
            raise self._emitter.fault(tr("this kind of variable is declared outside functions"))
        for declared in node.variables:
            if declared.name in self._emitter.scope.slots:
                raise self._emitter.fault(tr("{name} is declared twice", name=declared.name))
            kind = self._types[node.type_name]
            bounds = bounds_of(declared.bounds, self._emitter, most_elements(kind, "local"))
            slot = LocalSlot(declared.name, kind, bounds or (), bounds is not None)
            self._emitter.scope.declare(slot)

    def _guarded(self, compiled: Callable[[Any], None], node: object) -> None:
        try:
            compiled(node)
        except ProgramFault as fault:
            self.faults.append(fault)
        except RecursionError:
            self.faults.append(self._emitter.fault(tr("The line is too deeply nested.")))

    def _one(self, node: LineNode, place: SourcePlace) -> None:
        self._emitter.begin(place)
        self._guarded(self._statement, node)

    def _label(self, label: str) -> None:
        labels = self._emitter.function.labels
        if label in labels:
            self.faults.append(
                self._emitter.fault(tr("the label {label} appears twice", label=label))
            )
        target = labels.setdefault(label, JumpTarget())
        self._emitter.put(target)

    def _target(self, label: str) -> JumpTarget:
        target = JumpTarget()
        self._wanted.append((label, target, self._emitter.place))
        return target

    def _settle(self) -> None:
        """Let the jumps lead to their labels."""
        labels = self._emitter.function.labels
        for label, target, place in self._wanted:
            if label in labels:
                target.pc = labels[label].pc
            else:
                text = tr("error 3108: there is no label {label} in this function", label=label)
                self.faults.append(ProgramFault(place, text))

    def _statement(self, node: LineNode) -> None:
        if self._blocks.compile(node):
            return
        emitter = self._emitter
        match node:
            case Declaration():
                pass
            case If():
                self._if(node)
            case Branching():
                self._branching(node)
            case OnError(label):
                emitter.emit(on_error(None if label is None else self._target(label)))
            case ErrorResume(label, following):
                target = None if label is None else self._target(label)
                emitter.emit(error_resume(target, following=following))
            case Call():
                self._call(node)
            case AssignVariable(name, value):
                self._assign(name, value)
            case AssignElement(name, subscripts, value):
                self._assign_element(name, subscripts, value)
            case Redim(name, bounds, kept):
                runs = [emitter.run(bound) for bound in bounds]
                emitter.emit(redim(emitter.array(Name(name)), runs, keep_values=kept))
            case Trap(_, _, action, target) if action == "goto" and target is not None:
                emitter.emit(compile_family(emitter, node, self._target(target)))
            case (
                TaskStatement()
                | ChannelStatement()
                | Trap()
                | VisionRun()
                | VisionAccess()
                | VisionStatement()
            ):
                emitter.emit(compile_family(emitter, node))
            case Unsimulated(word):
                emitter.emit(refuse(RefusalKind.NOT_SIMULATED, f"{word} is not simulated"))
            case _:
                self._machine(node)  # type: ignore[arg-type]

    def _if(self, node: If) -> None:
        """Compile a single-line If."""
        emitter, other, end = self._emitter, JumpTarget(), JumpTarget()
        emitter.emit(jump_if(emitter.run(node.condition), other, holds=False))
        for statement in node.then:
            self._one(statement, emitter.place)
        if node.otherwise:
            emitter.emit(jump(end))
        emitter.put(other)
        for statement in node.otherwise:
            self._one(statement, emitter.place)
        emitter.put(end)

    def _branching(self, node: Branching) -> None:
        emitter, label = self._emitter, node.label
        match node.word:
            case "goto" if label is not None:
                emitter.emit(jump(self._target(label)))
            case "gosub" if label is not None:
                emitter.emit(go_sub(self._target(label)))
            case "return":
                emitter.emit(go_back)
            case "exit function":
                emitter.emit(leave)
            case word:
                self._blocks.leave(word.removeprefix("exit "))

    def _call(self, node: Call) -> None:
        emitter = self._emitter
        if node.name in emitter.functions:
            emitter.call(node.name, node.arguments)
            return
        emitter.emit(compile_family(emitter, node))

    def _assign(self, name: str, value: Expression | Coordinates) -> None:
        emitter, scope = self._emitter, self._emitter.scope
        known = scope.holds(name) or scope.undeclared is not None
        if not known or isinstance(value, Coordinates):
            # A point by its label (seen: washpos = XY(...)).
            if scope.labels is not None and name not in scope.labels:
                raise emitter.fault(tr("nothing is called {name}", name=name))
            self._machine(AssignPoint(PointExpression(LabelledPoint(name)), value))
            return
        run = emitter.run(value)
        emitter.variable(Name(name))
        if name in scope.slots:
            kind = scope.kind(name)
            emitter.emit(assign_local(scope.slots[name], kind, run))
        else:
            emitter.emit(assign_shared(scope.shared(name), run))

    def _assign_element(
        self, name: str, subscripts: tuple[Expression, ...], value: Expression | Coordinates
    ) -> None:
        emitter = self._emitter
        if not emitter.scope.holds(name):
            emitter.emit(compile_family(emitter, AssignElement(name, subscripts, value)))
            return
        if isinstance(value, Coordinates):
            raise emitter.fault(tr("{name} holds no coordinates", name=name))
        runs = [emitter.run(subscript) for subscript in subscripts]
        run = emitter.run(value)
        emitter.emit(assign_element(emitter.array(Name(name)), runs, run))

    def _machine(self, statement: Statement) -> None:
        """Compile a statement that the command window knows too."""
        emitter = self._emitter
        if isinstance(statement, KeywordStatement):
            if statement.name in WINDOW_ONLY:
                raise emitter.fault(
                    tr("{word} is for the command window only", word=statement.name)
                )
            statement = without_forced(statement)
            if statement.name == "reset" and statement.arguments == (Name("error"),):
                emitter.emit(clear_for_error)
        prepared = emitter.hoisted(statement)
        self._check(prepared)
        emitter.emit(carry_out(prepared))

    def _check(self, node: object) -> None:
        """Check every expression in a statement, so that errors are reported at the build."""
        if isinstance(node, tuple):
            for part in node:
                self._check(part)
        elif isinstance(node, Name):
            self._emitter.checked(node)
        elif isinstance(node, LabelledPoint):
            self._emitter.checked(Name(node.name))
        elif isinstance(node, Binary) and label_in(node, self._emitter.scope.holds) is not None:
            self._check(modified(node))
        elif hasattr(node, "__dataclass_fields__"):
            for name in node.__dataclass_fields__:
                self._check(getattr(node, name))


def clear_for_error(task: SpelTask) -> None:
    """Do for Reset Error what comes before the error is cleared.

    Raises:
        Refusal: The preference does not let programs say it.
    """
    require_advanced(task)
    task.runner.end_others(task)


def carry_out(statement: Statement) -> Operation:
    """Pass a statement to the executor of the command window."""
    return lambda _: statement


def without_forced(statement: KeywordStatement) -> KeywordStatement:
    """Return a statement without ``Forced``: the kind of the task decides what it allows."""
    if statement.arguments and statement.arguments[-1] == Name("forced"):
        return replace(statement, arguments=statement.arguments[:-1])
    return statement


def bounds_of(
    bounds: tuple[Expression, ...] | None, emitter: Emitter, most: int
) -> tuple[int, ...] | None:
    """Return the bounds of a declared array, ``None`` for a scalar.

    Args:
        bounds: As they are written.
        emitter: Says where.
        most: How many elements it may have.

    Raises:
        ProgramFault: They are no whole numbers, or there are too many elements.
    """
    if bounds is None:
        return None
    values = []
    for bound in bounds:
        value = getattr(bound, "value", None)
        if not isinstance(value, int) or value < 0:
            raise emitter.fault(tr("the bound of an array is a number, 0 or more"))
        values.append(value)
    if elements(values) > most:
        raise emitter.fault(tr("this array may have {most} elements", most=most))
    return tuple(values) or (0,)
