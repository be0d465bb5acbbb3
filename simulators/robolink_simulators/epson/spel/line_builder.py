"""The reductions of a program's line turned into values of ``line_tree``."""

from typing import Any, cast

from lark import Token, v_args

from robolink_simulators.epson.spel.line_tree import (
    AssignElement,
    BlockElseIf,
    BlockIf,
    BlockWord,
    Branching,
    Call,
    Case,
    ChannelStatement,
    Declaration,
    Declared,
    ErrorResume,
    ForLoop,
    FunctionHeader,
    LineNode,
    LoopEdge,
    NextPass,
    OnError,
    Parameter,
    Redim,
    Select,
    TaskStatement,
    Trap,
    Unsimulated,
    VisionAccess,
    VisionRun,
    VisionStatement,
)
from robolink_simulators.epson.spel.tree import (
    ByReference,
    Coordinates,
    Expression,
    Name,
    PointRange,
    PrintTo,
)
from robolink_simulators.epson.spel.tree_builder import Items, TreeBuilder

_SCOPES = {"global": "global", "static": "module"}
_SCOPES |= {"global preserve": "preserve", "global static": "global", "global nonstatic": "global"}


def _word(token: Token) -> str:
    return " ".join(token.lower().split())


@v_args(inline=True)
class ProgramBuilder(TreeBuilder):
    """One method per named rule of the grammar that programs alone use."""

    def program_line(self, *parts: LineNode | None) -> tuple[LineNode, ...]:
        """Collect the statements of a line."""
        return tuple(part for part in parts if part is not None)

    def block_if(self, _: Token, condition: Expression, __: Token) -> BlockIf:
        """Build the first line of a block."""
        return BlockIf(condition)

    def block_else_if(self, _: Token, condition: Expression, __: Token) -> tuple[LineNode, ...]:
        """Build a further condition; it stands alone in its line."""
        return (BlockElseIf(condition),)

    def block_else(self, _: Token) -> tuple[LineNode, ...]:
        """Build Else; it stands alone in its line."""
        return (BlockWord("else"),)

    def end_if(self, _: Token) -> BlockWord:
        """Build EndIf."""
        return BlockWord("endif")

    def select(self, _: Token, value: Expression) -> Select:
        """Build the first line of a Select."""
        return Select(value)

    def case(self, _: Token, sign: Token | None, value: Expression) -> Case:
        """Build a Case; ``Case < 1`` stands in a public program."""
        return Case(value, "=" if sign is None else str(sign))

    def default_case(self, _: Token) -> BlockWord:
        """Build Default."""
        return BlockWord("default")

    def end_select(self, _: Token) -> BlockWord:
        """Build Send."""
        return BlockWord("send")

    def for_loop(self, *parts: Any) -> ForLoop:  # noqa: ANN401 - words and expressions
        """Build the first line of a For."""
        _, variable, start, _, end, *step = parts
        return ForLoop(variable, start, end, step[-1] if step else None)

    def next_pass(self, _: Token, variable: Token | None) -> NextPass:
        """Build Next."""
        return NextPass(None if variable is None else variable.lower())

    def do_loop(self, _: Token, *test: Any) -> LoopEdge:  # noqa: ANN401 - a word, a condition
        """Build Do."""
        return _edge("do", test)

    def loop_end(self, _: Token, *test: Any) -> LoopEdge:  # noqa: ANN401 - a word, a condition
        """Build Loop."""
        return _edge("loop", test)

    def function_header(self, _: Token, name: Token, *rest: Any) -> FunctionHeader:  # noqa: ANN401
        """Build the first line of a function."""
        parameters, _as, type_name = rest
        kind = None if type_name is None else type_name.lower()
        return FunctionHeader(name.lower(), str(name), parameters or (), kind)

    def parameters(self, *parameters: Parameter) -> tuple[Parameter, ...]:
        """Collect what a function takes."""
        return parameters

    def scalar_parameter(
        self, way: Token | None, name: Token, _: Token, type_name: Token
    ) -> Parameter:
        """Build a single value; ByVal is the default."""
        by_reference = way is not None and way.lower() == "byref"
        return Parameter(name.lower(), type_name.lower(), by_reference, array=False)

    def array_parameter(self, _: Token | None, name: Token, __: Token, kind: Token) -> Parameter:
        """Build an array."""
        return Parameter(name.lower(), kind.lower(), by_reference=True, array=True)

    def function_end(self, _: Token) -> BlockWord:
        """Build Fend."""
        return BlockWord("fend")

    def variable(self, name: Token, *bounds: Items | None) -> Declared:
        """Build one variable of a declaration."""
        return Declared(name.lower(), bounds[0] if bounds else None)

    def local_declaration(self, kind: Token, *variables: Declared) -> Declaration:
        """Build a declaration; outside functions it is the module's."""
        return Declaration("local", kind.lower(), variables)

    def scoped_declaration(self, scope: Token, kind: Token, *variables: Declared) -> Declaration:
        """Build a declaration with Global or Static."""
        return Declaration(_SCOPES[_word(scope)], kind.lower(), variables)

    def goto(self, _: Token, label: Token) -> Branching:
        """Build GoTo."""
        return Branching("goto", label.lower())

    def gosub(self, _: Token, label: Token) -> Branching:
        """Build GoSub."""
        return Branching("gosub", label.lower())

    def return_back(self, _: Token) -> Branching:
        """Build Return."""
        return Branching("return")

    def exit_block(self, word: Token) -> Branching:
        """Build Exit Do, Exit For or Exit Function."""
        return Branching(_word(word))

    def on_error(self, *parts: Token | None) -> OnError:
        """Build OnErr; a number, which can only be 0, clears it."""
        label = cast(Token, parts[-1])
        return OnError(None if label[0].isdigit() else label.lower())

    def error_resume(self, _: Token, label: Token | None) -> ErrorResume:
        """Build EResume."""
        if label is None:
            return ErrorResume()
        following = label.lower() == "next"
        return ErrorResume(None if following else label.lower(), following)

    def arguments(self, *arguments: Expression) -> tuple[Expression, ...]:
        """Collect what stands between the commas of a call."""
        return arguments

    def by_reference(self, _: Token, name: Token, *items: Items | None) -> ByReference:
        """Build ``ByRef x`` or ``ByRef a()``."""
        return ByReference(Name(name.lower(), items[0] if items else None))

    def call(self, _: Token, name: Token, *arguments: tuple[Expression, ...] | None) -> Call:
        """Build a call with the word Call."""
        return Call(name.lower(), (arguments[0] if arguments else None) or (), explicit=True)

    def bare_call(self, name: Token, *arguments: tuple[Expression, ...] | None) -> Call:
        """Build a call without it."""
        return Call(name.lower(), (arguments[0] if arguments else None) or (), explicit=False)

    def assign_element(
        self, name: Token, subscripts: tuple[Expression, ...], value: Expression | Coordinates
    ) -> AssignElement:
        """Build ``a(1) = ...``."""
        return AssignElement(name.lower(), subscripts, value)

    def redim(self, word: Token, name: Token, bounds: Items) -> Redim:
        """Build Redim."""
        return Redim(name.lower(), bounds, keep="preserve" in word.lower())

    def channel_statement(
        self, word: Token, channel: Expression, items: Items | None
    ) -> ChannelStatement:
        """Build a statement about a numbered port."""
        return ChannelStatement(_word(word), channel, items or ())

    def open_channel(
        self, word: Token, channel: Expression, _: Token, role: Token
    ) -> ChannelStatement:
        """Build ``OpenNet #201 As Client``."""
        return ChannelStatement(_word(word), channel, (), role.lower())

    def plain_channel(self, word: Token, items: Items | None) -> ChannelStatement:
        """Build one without a port."""
        return ChannelStatement(_word(word), None, items or ())

    def open_file(
        self, word: Token, name: Expression, _: Token, channel: Expression
    ) -> ChannelStatement:
        """Build ``WOpen f$ As #30``."""
        return ChannelStatement(_word(word), channel, (name,))

    def print_to(
        self, _: Token, channel: Expression, items: Items | None, trailing: Token | None
    ) -> PrintTo:
        """Build ``Print #201, ...``."""
        return PrintTo(channel, items or (), trailing is None)

    def start_task(self, _: Token, items: Items) -> TaskStatement:
        """Build Xqt."""
        return TaskStatement("xqt", items)

    def task_statement(self, word: Token, items: Items | None) -> TaskStatement:
        """Build a statement about tasks, locks, signals or errors."""
        return TaskStatement(word.lower(), items or ())

    def trap(self, _: Token, event: Expression, condition: Expression | None, *rest: Any) -> Trap:  # noqa: ANN401
        """Build Trap."""
        action, target = (token.lower() if token else None for token in rest[:2])
        return Trap(event, condition, action, target)

    def vision_run(self, _: Token, sequence: Expression) -> VisionRun:
        """Build VRun."""
        return VisionRun(sequence)

    def vision_access(
        self, word: Token, path: Token, index: Expression | None, items: Items
    ) -> VisionAccess:
        """Build VGet or VSet."""
        parts = tuple(part.strip().lower() for part in path.split("."))
        return VisionAccess(word.lower(), parts, index, items)

    def vision_project(self, word: Token) -> VisionStatement:
        """Build VLoad, VSave or VCls."""
        return VisionStatement(word.lower())

    def vision_calibrate(self, word: Token, name: Expression) -> VisionStatement:
        """Build VCal."""
        return VisionStatement(word.lower(), (name,))

    def vision_image(self, word: Token, *items: Expression) -> VisionStatement:
        """Build VSaveImage."""
        return VisionStatement(word.lower(), items)

    def image_calibrate(
        self, word: Token, number: Expression, mounting: Expression, *ranges: PointRange
    ) -> VisionStatement:
        """Build VxCalib."""
        return VisionStatement(word.lower(), (number, mounting), ranges)

    def unsimulated(self, word: Token, _: Token | None) -> Unsimulated:
        """Build a statement that is known and not carried out."""
        return Unsimulated(word.lower())


def _edge(word: str, test: tuple[Any, ...]) -> LoopEdge:
    if not test or test[0] is None:
        return LoopEdge(word)
    return LoopEdge(word, test[0].lower(), test[1])
