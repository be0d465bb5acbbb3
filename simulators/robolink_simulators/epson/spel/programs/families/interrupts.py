"""Trap (docs/reference/spel.md 4.7)."""

from robolink.messages import tr
from robolink_simulators.epson.spel.expressions.values import as_integer, out_of_range
from robolink_simulators.epson.spel.line_tree import Trap
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled import CompiledFunction, JumpTarget, Operation
from robolink_simulators.epson.spel.tasks.permissions import require_unbound
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.traps import (
    EVENTS,
    HIGHEST_TRAP,
    TOLD_OF_ERROR,
    SetTrap,
)
from robolink_simulators.epson.spel.tree import Name, names_in


def compile_trap(emitter: Emitter, node: Trap, label: JumpTarget | None) -> Operation:
    """Return what sets a trap, or takes it away.

    Raises:
        ProgramFault: It makes no sense.
    """
    function = _function(emitter, node)
    if isinstance(node.event, Name) and node.event.name in EVENTS:
        event = node.event.name

        def follow(t: SpelTask) -> None:
            require_unbound(t)
            t.runner.traps.on_event(event, function)

        return follow
    number, condition, names = emitter.run(node.event), None, names_in(node.condition)
    if node.condition is not None:
        condition = emitter.run(node.condition)
    if (condition is None) is not (node.action is None):
        raise emitter.fault(tr("a trap needs a condition and what it does"))

    def go(t: SpelTask) -> None:
        require_unbound(t)
        wanted = as_integer(number(t))
        if not 1 <= wanted <= HIGHEST_TRAP:
            raise out_of_range(f"Trap {wanted}")
        trap = None
        if condition is not None:
            starts = node.action == "xqt"
            trap = SetTrap(t, t.frame, condition, label, function, starts, names)
        t.runner.traps.set(wanted, trap)

    return go


def _function(emitter: Emitter, node: Trap) -> CompiledFunction | None:
    if node.action in (None, "goto") or node.target is None:
        return None
    function = emitter.functions.get(node.target)
    if function is not None and node.event == Name("error") and _told_of_error(function):
        return function
    if function is None or function.parameters:
        text = tr("there is no function {name} without arguments", name=node.target)
        raise emitter.fault(text)
    return function


def _told_of_error(function: CompiledFunction) -> bool:
    """Tell whether a function takes what Trap Error tells."""
    count = len(TOLD_OF_ERROR)
    kinds = [slot.kind.name for slot in function.variables[1 : 1 + function.parameters]]
    alone = not any(function.by_reference) and not any(function.arrays)
    return kinds == ["integer"] * count and alone
