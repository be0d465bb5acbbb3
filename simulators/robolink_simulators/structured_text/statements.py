"""Statements of the text, translated into functions of the frame."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from lark import Token

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    BlockType,
    Family,
    Frame,
    Getter,
    OpaqueType,
    ScalarType,
    TextVariable,
    Typed,
    as_number,
    copier,
    fitted,
    kept,
    same,
    settled,
    type_name,
)
from robolink_simulators.structured_text.expressions import ExpressionTranslator
from robolink_simulators.structured_text.parse import (
    Node,
    TextDialect,
    TextPlace,
    refused,
)
from robolink_simulators.structured_text.references import (
    SPENT,
    Runtime,
    TextScope,
    VariableReference,
)

if TYPE_CHECKING:
    from robolink_simulators.structured_text.expressions import ExpressionTranslator


Step = Callable[[Frame, Frame], None]
"""Carries out one step. Takes the caller's frame and the instance's frame."""


def call(
    tree: Node, translator: "ExpressionTranslator", scope: TextScope
) -> Callable[[Frame], int]:
    """Translate the call of an instance.

    Raises:
        StructuredTextError: It is no instance, or a pin is missing or does not fit.
    """
    called, *arguments = tree.children
    place = translator.place(tree)
    instance = translator.reference(called)
    block = instance.type
    if not isinstance(block, BlockType):
        raise refused(place, tr("{name} is not a function block", name=instance.name))
    before: list[Step] = []
    after: list[Step] = []
    named: set[str] = set()
    for argument in arguments:
        if argument is None:
            continue
        pin, value = argument.children
        where = translator.place(argument)
        member = block.members.get(str(pin).lower())
        if member is None or member.name in named:
            raise refused(where, tr("{block} has no pin {pin}", block=block.name, pin=str(pin)))
        named.add(member.name)
        if argument.data == "given":
            before.append(_given(member, value, translator, where))
        else:
            after.append(_taken(member, value, translator, where))
    missing = [m.name for m in block.members.values() if m.kind == "var_in_out"]
    missing = [name for name in missing if name not in named]
    if missing:
        raise refused(place, tr("the pin {pin} must be connected", pin=missing[0]))
    get = instance.get
    del scope

    def invoke(frame: Frame) -> int:
        inside = get(frame)
        for step in before:
            step(frame, inside)
        block.run(inside)
        for step in after:
            step(frame, inside)
        return 0

    return invoke


def _given(
    member: TextVariable, value: Node, translator: "ExpressionTranslator", place: TextPlace
) -> Step:
    slot = member.slot
    if member.kind == "var_in_out":
        return _by_reference(member, value, translator, place)
    if member.kind != "var_input":
        raise refused(place, tr("{pin} is not an input", pin=member.name))
    if isinstance(member.type, ScalarType):
        get = kept(translator.expression(value), member.type, place)

        def put(frame: Frame, inside: Frame) -> None:
            inside[slot] = get(frame)

        return put
    source = fitted(translator.expression(value), member.type, place).get
    if isinstance(member.type, BlockType):
        raise refused(place, tr("an instance is handed in by VAR_IN_OUT only"))
    copy = copier(member.type)

    def put_all(frame: Frame, inside: Frame) -> None:
        copy(inside[slot], source(frame))

    return put_all


def _by_reference(
    member: TextVariable, value: Node, translator: "ExpressionTranslator", place: TextPlace
) -> Step:
    if value.data != "reference":
        raise refused(place, tr("{pin} takes a variable", pin=member.name))
    given = translator.reference(value)
    if not same(given.type, member.type):
        raise refused(
            place,
            tr(
                "{found} appears where {wanted} is expected",
                found=type_name(given.type),
                wanted=type_name(member.type),
            ),
        )
    if not given.writable:
        raise refused(place, tr("{name} can only be read here", name=given.name))
    slot = member.slot
    source = given.locate if isinstance(member.type, ScalarType) else given.get

    def connect(frame: Frame, inside: Frame) -> None:
        inside[slot] = source(frame)

    return connect


def _taken(
    member: TextVariable, value: Node, translator: "ExpressionTranslator", place: TextPlace
) -> Step:
    target = translator.reference(value)
    fits = member.kind == "var_output" and same(member.type, target.type)
    if not fits or not isinstance(member.type, ScalarType) or not target.writable:
        raise refused(place, tr("{pin} is not an output for that", pin=member.name))
    slot, store = member.slot, target.storer()

    def take(frame: Frame, inside: Frame) -> None:
        store(frame, inside[slot])

    return take


Action = Callable[[Frame], int]
"""Executes a statement. Returns how it ended."""

_ON, _EXIT, _RETURN = range(3)
_MOST_LABELS: Final = 4

TURNS_A_CYCLE: Final = 200_000
"""Most loop iterations in one cycle. A real PLC's watchdog would have stopped the program long
before.
"""


class StatementTranslator(ExpressionTranslator):
    """Translates the statements of one block."""

    def __init__(self, scope: TextScope) -> None:
        super().__init__(scope)
        self._all: dict[str, Callable[[Node], Action]] = {
            "assignment": self._assignment,
            "call": self._call,
            "if_statement": self._if,
            "case_statement": self._case,
            "for_statement": self._for,
            "while_statement": self._while,
            "repeat_statement": self._repeat,
            "exit_statement": self._exit,
            "return_statement": lambda _: lambda _: _RETURN,
        }
        self._depth = 0

    def block(self, tree: Node) -> Action:
        """Translate statements that follow each other."""
        actions = [self._all[child.data](child) for child in tree.children]
        if len(actions) == 1:
            return actions[0]
        steps = tuple(actions)

        def run(frame: Frame) -> int:
            for step in steps:
                end = step(frame)
                if end:
                    return end
            return _ON

        return run

    def _assignment(self, tree: Node) -> Action:
        target_tree, value_tree = tree.children
        place = self.place(tree)
        target = self.reference(target_tree)
        self._require_writable(target, place)
        value = self.expression(value_tree)
        if isinstance(target.type, ScalarType):
            return _storing(target, kept(value, target.type, place))
        fits = fitted(value, target.type, place)
        if isinstance(target.type, OpaqueType):
            return _storing(target, fits.get)
        if isinstance(target.type, BlockType):
            raise refused(place, tr("{name} is a function block, not a value", name=target.name))
        source, get = fits.get, target.get
        copy = copier(target.type)

        def assign(frame: Frame) -> int:
            copy(get(frame), source(frame))
            return _ON

        return assign

    def _require_writable(self, target: VariableReference, place: TextPlace) -> None:
        if not target.writable:
            raise refused(place, tr("{name} can only be read here", name=target.name))
        if target.simple and target.name in self._scope.turning:
            raise refused(place, tr("the loop alone changes {name}", name=target.name))

    def _call(self, tree: Node) -> Action:
        return call(tree, self, self._scope)

    def _if(self, tree: Node) -> Action:
        condition, then, *rest = tree.children
        arms = [(self.condition(condition).get, self.block(then))]
        otherwise: Action | None = None
        for part in rest:
            if part is None or isinstance(part, Token):
                continue
            if part.data == "else_if":
                test, block = part.children
                arms.append((self.condition(test).get, self.block(block)))
            else:
                otherwise = self.block(part)
        if len(arms) == 1:
            return _one_armed(*arms[0], otherwise)

        def decide(frame: Frame) -> int:
            for test, action in arms:
                if test(frame):
                    return action(frame)
            return otherwise(frame) if otherwise else _ON

        return decide

    def _case(self, tree: Node) -> Action:
        selector_tree, *parts = tree.children
        place = self.place(tree)
        selector = as_number(self.expression(selector_tree))
        if selector.scalar is None or selector.scalar.family is not Family.INTEGER:
            raise refused(place, tr("CASE chooses by a whole number"))
        get = settled(selector, place, "CASE").get
        singles: dict[int, Action] = {}
        ranges: list[tuple[range, Action]] = []
        otherwise: Action = _nothing
        for part in parts:
            if part is None:
                continue
            if part.data == "block":
                otherwise = self.block(part)
                continue
            *labels, block = part.children
            self._require_short(labels, part)
            action = self.block(block)
            for label in labels:
                self._label(label, action, singles, ranges)

        def choose(frame: Frame) -> int:
            value = get(frame)
            action = singles.get(value)
            if action is None:
                action = next((act for span, act in ranges if value in span), otherwise)
            return action(frame)

        return choose

    def _require_short(self, labels: Sequence[Node], branch: Node) -> None:
        """Refuse more labels than STruC++ reads (docs/reference/structured_text.md 1)."""
        signs = sum(1 if label.children[1] is None else 2 for label in labels)
        if signs > _MOST_LABELS and self._scope.dialect is TextDialect.COMMON:
            place = self.place(branch)
            raise refused(place, tr("a branch has four labels at most; a range counts as two"))

    def _label(
        self,
        label: Node,
        action: Action,
        singles: dict[int, Action],
        ranges: list[tuple[range, Action]],
    ) -> None:
        first, last = label.children
        low, high = bound_value(first), None if last is None else bound_value(last)
        span = range(low, (low if high is None else high) + 1)
        taken = any(number in span for number in singles) or any(
            other.start < span.stop and span.start < other.stop for other, _ in ranges
        )
        if taken:
            raise refused(self.place(label), tr("the label appears twice"))
        if high is None:
            singles[low] = action
        else:
            ranges.append((span, action))

    def _for(self, tree: Node) -> Action:
        name, first_tree, last_tree, step_tree, body_tree = tree.children
        place = self.place(tree)
        low = str(name).lower()
        variable = self._scope.members.get(low)
        of = variable.type if variable else None
        if not isinstance(of, ScalarType) or of.family is not Family.INTEGER or not variable:
            raise refused(place, tr("{name} is not a whole number of this block", name=str(name)))
        if variable.kind == "var_in_out" or low in self._scope.turning:
            raise refused(place, tr("{name} cannot count this loop", name=str(name)))
        first = kept(self._bound(first_tree), of, place)
        last = kept(self._bound(last_tree), of, place)
        step = 1 if step_tree is None else bound_value(step_tree)
        if step == 0:
            raise refused(place, tr("a loop that counts by 0 never ends"))
        self._scope.turning.append(low)
        body = self._loop_body(body_tree)
        self._scope.turning.pop()
        return _counting(variable.slot, first, last, step, body, self._scope.runtime, place)

    def _bound(self, tree: Node) -> Typed:
        return settled(self.expression(tree), self.place(tree), "FOR")

    def _while(self, tree: Node) -> Action:
        condition_tree, body_tree = tree.children
        test = self.condition(condition_tree).get
        body = self._loop_body(body_tree)
        runtime, place = self._scope.runtime, self.place(tree)

        def turn(frame: Frame) -> int:
            while test(frame):
                _count_turn(runtime, place)
                end = body(frame)
                if end:
                    return _ON if end == _EXIT else end
            return _ON

        return turn

    def _repeat(self, tree: Node) -> Action:
        body_tree, condition_tree = tree.children
        body = self._loop_body(body_tree)
        test = self.condition(condition_tree).get
        runtime, place = self._scope.runtime, self.place(tree)

        def turn(frame: Frame) -> int:
            while True:
                _count_turn(runtime, place)
                end = body(frame)
                if end:
                    return _ON if end == _EXIT else end
                if test(frame):
                    return _ON

        return turn

    def _loop_body(self, tree: Node) -> Action:
        self._depth += 1
        body = self.block(tree)
        self._depth -= 1
        return body

    def _exit(self, tree: Node) -> Action:
        if not self._depth:
            raise refused(self.place(tree), tr("EXIT is not in a loop"))
        return lambda _: _EXIT


def _nothing(_: Frame) -> int:
    return _ON


def _storing(target: VariableReference, get: Getter) -> Action:
    slot = target.slot
    if slot >= 0:

        def assign(frame: Frame) -> int:
            frame[slot] = get(frame)
            return _ON

        return assign
    locate = target.locate

    def assign_there(frame: Frame) -> int:
        value = get(frame)
        container, key = locate(frame)
        container[key] = value
        return _ON

    return assign_there


def _one_armed(test: Getter, then: Action, otherwise: Action | None) -> Action:
    if otherwise is None:
        return lambda frame: then(frame) if test(frame) else _ON
    return lambda frame: then(frame) if test(frame) else otherwise(frame)


def _counting(
    slot: int,
    first: Getter,
    last: Getter,
    step: int,
    body: Action,
    runtime: Runtime,
    place: TextPlace,
) -> Action:
    """A FOR loop; its end is calculated at each turn, as both compilers do."""

    def count(frame: Frame) -> int:
        value = frame[slot] = first(frame)
        turned = False
        while (value <= last(frame)) if step > 0 else (value >= last(frame)):
            runtime.turns_left -= 1
            if runtime.turns_left < 0:
                raise _turned_too_often(place)
            end = body(frame)
            if end:
                return _ON if end == _EXIT else end
            turned = True
            value += step
            frame[slot] = value
        if turned:
            frame[slot] = SPENT
        return _ON

    return count


def _count_turn(runtime: Runtime, place: TextPlace) -> None:
    runtime.turns_left -= 1
    if runtime.turns_left < 0:
        raise _turned_too_often(place)


def _turned_too_often(place: TextPlace) -> Exception:
    return refused(
        place, tr("the loops of one cycle turned more than {count} times", count=TURNS_A_CYCLE)
    )


def bound_value(tree: Node) -> int:
    """Return a whole number of a label, a step or a bound."""
    *sign, digits = (str(part) for part in tree.children if part is not None)
    number = int(digits.replace("_", ""))
    return -number if sign else number


def counted_in(tree: Node) -> set[str]:
    """Return the variables that count loops, in small letters."""
    return {str(loop.children[0]).lower() for loop in tree.find_data("for_statement")}
