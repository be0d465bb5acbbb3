"""What statements do that take no time: print, assign, set.

What takes time (motion, Wait, what stands inside ``!...!``) is :class:`StatementExecution`'s.
"""

from robolink_simulators.epson.refusals import RefusalKind, RequestRefused, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.printing import (
    CRLF,
    LONGEST_PRINT_TO,
    joined,
    number_text,
)
from robolink_simulators.epson.spel.expressions.values import Value, as_number
from robolink_simulators.epson.spel.statements.defined.curves import store_curve
from robolink_simulators.epson.spel.statements.keywords import StatementOutcome, run_command
from robolink_simulators.epson.spel.tree import (
    AssignCoordinate,
    AssignPoint,
    AssignVariable,
    Coordinates,
    KeywordStatement,
    MotionStatement,
    Print,
    PrintTo,
    Statement,
)


def effect(evaluator: Evaluator, statement: Statement) -> StatementOutcome:
    """Carry a statement out at once.

    Raises:
        Refusal: It cannot be carried out.
    """
    match statement:
        case Print(items, newline):
            session = evaluator.session
            values = [evaluator.shown(item) for item in items]
            text = joined(values, session.options, session.machine.model)
            return StatementOutcome(text + (CRLF if newline else ""))
        case KeywordStatement():
            return run_command(evaluator, statement)
        case MotionStatement("curve"):
            store_curve(evaluator, statement)
        case PrintTo():
            _print_to(evaluator, statement)
        case AssignPoint() | AssignCoordinate():
            _store(evaluator, statement)
        case AssignVariable(name, value) if (
            number := evaluator.session.machine.points.labelled(name)
        ) is not None:
            evaluator.session.machine.points.store(number, evaluator.point_of(value))
        case AssignVariable(name, Coordinates()):
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold coordinates")
        case AssignVariable(name, expression) if not isinstance(expression, Coordinates):
            _assign(evaluator, name, evaluator.value(expression))
        case _:
            raise AssertionError(statement)
    return StatementOutcome()


def _store(evaluator: Evaluator, statement: AssignPoint | AssignCoordinate) -> None:
    points = evaluator.session.machine.points
    if isinstance(statement, AssignPoint):
        point = evaluator.point_of(statement.value)
        points.store(evaluator.point_number(statement.number), point)
        return
    number = evaluator.stored_number(statement.point)
    value = float(evaluator.number(statement.value))
    points.store(number, points.get(number).assigned(statement.axis, value))


def _assign(evaluator: Evaluator, name: str, value: Value) -> None:
    session = evaluator.session
    if session.options.variable_assignment == "refused":
        # Whether the command window takes variables is left open (docs/reference/spel.md 13).
        raise SpelRefusal(RefusalKind.NOT_ALLOWED_HERE, f"{name} needs a program")
    if not session.variables.holds(name):
        raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
    text = value if isinstance(value, str) else number_text(as_number(value))
    try:
        session.variables.set(name, text)
    except RequestRefused as refused:
        raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"{name} cannot hold {text}") from refused


def _print_to(evaluator: Evaluator, statement: PrintTo) -> None:
    """Print to a port: only those that a program has opened are there."""
    session = evaluator.session
    channel = evaluator.integer(statement.channel)
    values = [evaluator.shown(item) for item in statement.items]
    text = joined(values, session.options, session.machine.model, longest=LONGEST_PRINT_TO)
    evaluator.write_to(channel, text, ends=statement.newline)
