"""Blocks that are open while a function is compiled, and what their lines become."""

from dataclasses import dataclass, field

from robolink.messages import tr
from robolink_simulators.epson.spel.line_tree import (
    BlockElseIf,
    BlockIf,
    BlockWord,
    Case,
    ForLoop,
    LoopEdge,
    NextPass,
    Select,
)
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.operations import (
    case,
    for_next,
    for_start,
    jump,
    jump_if,
    keep,
    repeat,
)
from robolink_simulators.epson.spel.source_text import ProgramFault, SourcePlace
from robolink_simulators.epson.spel.tasks.compiled_program import JumpTarget
from robolink_simulators.epson.spel.tree import Expression

DEEPEST_FOR = 10
"""Deepest nesting of For (docs/reference/spel.md 4.3)."""

_ENDS = {"if": "EndIf", "select": "Send", "for": "Next", "do": "Loop"}


@dataclass(slots=True)
class _Block:
    word: str
    place: SourcePlace
    leave: JumpTarget = field(default_factory=JumpTarget)
    other: JumpTarget | None = None
    begin: JumpTarget = field(default_factory=JumpTarget)
    slot: int = -1
    variable: str = ""
    closed: bool = False


class BlockCompiler:
    """Turns the lines that begin, divide and end blocks into jumps."""

    def __init__(self, emitter: Emitter) -> None:
        self._emitter = emitter
        self._open: list[_Block] = []

    def compile(self, node: object) -> bool:
        """Compile a line if it is about a block; return whether it was.

        Raises:
            ProgramFault: It stands where it cannot.
        """
        match node:
            case BlockIf(condition):
                self._branch(self._push("if"), condition)
            case BlockElseIf(condition):
                self._branch(self._divide(), condition)
            case BlockWord(word):
                self._divider(word)
            case Select(value):
                self._select(value)
            case Case(value, sign):
                self._case(value, sign)
            case ForLoop():
                self._for(node)
            case NextPass(variable):
                self._next(variable)
            case LoopEdge("do", test, condition):
                self._do(test, condition)
            case LoopEdge(_, test, condition):
                self._loop(test, condition)
            case _:
                return False
        return True

    def leave(self, word: str) -> None:
        """Compile Exit Do or Exit For.

        Raises:
            ProgramFault: There is no such loop around it.
        """
        for block in reversed(self._open):
            if block.word == word:
                self._emitter.emit(jump(block.leave))
                return
        raise self._emitter.fault(tr("there is no such loop around it"))

    def finish(self) -> None:
        """Refuse what is still open at the end of the function.

        Raises:
            ProgramFault: A block was not closed.
        """
        if self._open:
            block = self._open[-1]
            raise ProgramFault(
                block.place, tr("this is never closed"), expected=(_ENDS[block.word],)
            )

    def _push(self, word: str) -> _Block:
        block = _Block(word, self._emitter.place)
        self._open.append(block)
        return block

    def _innermost(self, word: str) -> _Block:
        if not self._open or self._open[-1].word != word:
            wanted = (_ENDS[self._open[-1].word],) if self._open else ()
            raise self._emitter.fault(tr("no open block that this belongs to"), expected=wanted)
        return self._open[-1]

    def _branch(self, block: _Block, condition: Expression) -> None:
        block.other = JumpTarget()
        self._emitter.emit(jump_if(self._emitter.run(condition), block.other, holds=False))

    def _divide(self) -> _Block:
        """End one branch of an If and begin the next."""
        block = self._innermost("if")
        if block.closed or block.other is None:
            raise self._emitter.fault(tr("it comes after Else"), expected=("EndIf",))
        self._emitter.emit(jump(block.leave))
        self._emitter.put(block.other)
        return block

    def _divider(self, word: str) -> None:
        match word:
            case "else":
                block = self._divide()
                block.other, block.closed = None, True
            case "endif":
                block = self._innermost("if")
                self._close(block)
            case "default":
                block = self._innermost("select")
                self._end_case(block)
                block.other, block.closed = None, True
            case "send":
                self._close(self._innermost("select"))

    def _close(self, block: _Block) -> None:
        if block.other is not None:
            self._emitter.put(block.other)
        self._emitter.put(block.leave)
        self._open.pop()

    def _select(self, value: Expression) -> None:
        run = self._emitter.run(value)
        block = self._push("select")
        block.slot = self._emitter.slot()
        self._emitter.emit(keep(block.slot, run))

    def _case(self, value: Expression, sign: str) -> None:
        block = self._innermost("select")
        if block.closed:
            raise self._emitter.fault(tr("it comes after Default"), expected=("Send",))
        self._end_case(block)
        block.other = JumpTarget()
        self._emitter.emit(case(block.slot, sign, self._emitter.run(value), block.other))

    def _end_case(self, block: _Block) -> None:
        if block.other is not None:
            self._emitter.emit(jump(block.leave))
            self._emitter.put(block.other)

    def _for(self, loop: ForLoop) -> None:
        if sum(block.word == "for" for block in self._open) >= DEEPEST_FOR:
            raise self._emitter.fault(tr("For is nested in more than 10 other For"))
        emitter = self._emitter
        step = None if loop.step is None else emitter.run(loop.step)
        ends = (emitter.run(loop.start), emitter.run(loop.end), step)
        block = self._push("for")
        block.variable, block.slot = loop.variable.name, emitter.slot()
        reference = emitter.variable(loop.variable)
        at_top = emitter.options.for_test == "top"
        emitter.emit(for_start(reference, block.slot, ends, block.leave, at_top=at_top))
        emitter.put(block.begin)

    def _next(self, variable: str | None) -> None:
        block = self._innermost("for")
        if variable is not None and variable != block.variable:
            raise self._emitter.fault(tr("it names another variable"), expected=(block.variable,))
        self._emitter.emit(for_next(block.slot, block.begin))
        self._close(block)

    def _do(self, test: str | None, condition: Expression | None) -> None:
        block = self._push("do")
        self._emitter.put(block.begin)
        if condition is not None:
            run = self._emitter.run(condition)
            self._emitter.emit(jump_if(run, block.leave, holds=test == "until"))

    def _loop(self, test: str | None, condition: Expression | None) -> None:
        block = self._innermost("do")
        run = None if condition is None else self._emitter.run(condition)
        self._emitter.emit(repeat(run, block.begin, holds=test != "until"))
        self._close(block)
