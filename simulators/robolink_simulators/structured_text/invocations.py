"""Calls of function blocks: inputs that stay, outputs, and what is handed in by reference."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    BlockType,
    Frame,
    ScalarType,
    TextVariable,
    copier,
    same,
)
from robolink_simulators.structured_text.parse import (
    Node,
    TextPlace,
    refused,
)
from robolink_simulators.structured_text.references import TextScope
from robolink_simulators.structured_text.typed import fitted, kept, type_name

if TYPE_CHECKING:
    from robolink_simulators.structured_text.expressions import ExpressionTranslator

Step = Callable[[Frame, Frame], None]
"""Does one thing with the caller's frame and the instance."""


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
