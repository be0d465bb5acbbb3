"""Runs one line of the command window in simulated time."""

import random
from collections.abc import Mapping

from robolink_simulators.epson.condition import Condition, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.execution import SpelError as SpelError
from robolink_simulators.epson.spel.execution import (
    StatementExecution as StatementExecution,
)
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.parser import parse
from robolink_simulators.epson.spel.session import Session, WindowMemory


class Interpreter:
    """Carries out command-window lines, as Execute does.

    Args:
        machine: What the statements act on.
        options: The controller's habits and error numbers.
        rng: Source of RealPos's noise.
        condition: What the functions of the controller's state tell; one of its own if none.
        variables: The project's variables; none if none are given.
        messages: Texts of error numbers, for ErrMsg$.

    Example:
        >>> import random
        >>> from robolink_simulators.epson import EpsonOptions, EpsonSimulator
        >>> from robolink_simulators.epson.spel import Interpreter
        >>> machine = EpsonSimulator().machine
        >>> window = Interpreter(machine, EpsonOptions(), random.Random(1))
        >>> line = window.start("Wait 0.5; Print 6 * 7", now_ns=0)
        >>> line.done, line.next_change()
        (False, 500000000)
        >>> line.advance(500_000_000)
        >>> line.done, line.output.rstrip()
        (True, '42')
        >>> window.start("TLSet 0, XY(1, 0, 0, 0)", now_ns=0).error.text
        'Tool 0 is fixed'
    """

    def __init__(
        self,
        machine: Machine,
        options: EpsonOptions,
        rng: random.Random,
        *,
        condition: Condition | None = None,
        variables: Variables | None = None,
        messages: Mapping[int, str] | None = None,
    ) -> None:
        session = Session(
            machine,
            options,
            rng,
            condition or Condition(monitoring_only=False),
            variables or Variables(str(options.true_value)),
            {} if messages is None else messages,
        )
        self._evaluator = Evaluator(session)

    @property
    def session(self) -> Session:
        """What statements reach."""
        return self._evaluator.session

    def forget(self) -> None:
        """Forget the settings of statements: stored conditions, TMOut, TW, Err."""
        self._evaluator.session.memory = WindowMemory()

    def start(self, statement: str, now_ns: int) -> StatementExecution:
        """Begin a line at ``now_ns``; what takes no time is done when this returns.

        A line that cannot be parsed, or that holds a statement for programs only, gives an
        execution that has failed already: nothing of it was carried out.
        """
        try:
            statements = parse(statement)
        except SpelRefusal as refusal:
            execution = StatementExecution(self._evaluator, (), now_ns)
            execution.refuse(refusal)
            return execution
        execution = StatementExecution(self._evaluator, statements, now_ns)
        execution.advance(now_ns)
        return execution
