"""The command window: the one statement that Execute runs (docs/reference/epson.md 1.5)."""

from typing import Final

from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.remote.link import PendingRequest
from robolink_simulators.epson.spel import Interpreter, SpelError, StatementExecution
from robolink_simulators.faults import FaultAction

_IGNORE_WRITE: Final = FaultAction.IGNORE_WRITE  # before Python 3.12 a member is found slowly


class SpelWindow:
    """Runs one statement at a time and answers the Execute that brought it.

    A failed statement puts the controller into its error state (seen: clients must Reset
    after one, docs/reference/epson.md 1.5); an aborted one does not (assumed).
    """

    __slots__ = (
        "_aborted",
        "_aborting",
        "_condition",
        "_interpreter",
        "_options",
        "_running",
    )

    def __init__(
        self, interpreter: Interpreter, condition: Condition, options: EpsonOptions
    ) -> None:
        self._interpreter = interpreter
        self._condition = condition
        self._options = options
        self._running: tuple[StatementExecution, PendingRequest] | None = None
        self._aborting: list[PendingRequest] = []
        self._aborted = False

    @property
    def busy(self) -> bool:
        """Whether a statement is running."""
        return self._running is not None

    def start(self, statement: str, exchange: PendingRequest, now_ns: int) -> None:
        """Begin a statement; the exchange is answered when it has ended."""
        if exchange.meets(_IGNORE_WRITE):
            exchange.reply()
            return
        self._aborted = False
        self._running = (self._interpreter.start(statement, now_ns), exchange)
        self._settle()

    def advance(self, now_ns: int) -> None:
        """Continue the statement until ``now_ns``."""
        if self._running is not None:
            self._running[0].advance(now_ns)
            self._settle()

    def next_change(self) -> int | None:
        """Return when the statement will next do something."""
        return None if self._running is None else self._running[0].next_change()

    def abort(self, exchange: PendingRequest, now_ns: int) -> None:
        """Serve an Abort: end the statement, if one runs."""
        if self._running is None or self._options.abort_reply_first:
            exchange.reply()
        else:
            self._aborting.append(exchange)
        self.interrupt(now_ns)

    def interrupt(self, now_ns: int) -> None:
        """End the statement where the arm is, without an error state."""
        if self._running is not None:
            self._aborted = True
            self._running[0].abort(now_ns)
            self._settle()

    def restart(self) -> None:
        """Forget the settings of earlier statements: stored conditions, TMOut, TW."""
        self._interpreter.forget()

    def fail(self, number: int, text: str, now_ns: int) -> None:
        """End the statement where the arm is, with an error."""
        if self._running is not None:
            self._running[0].fail(SpelError(number, text), now_ns)
            self._settle()

    def _settle(self) -> None:
        if self._running is None or not self._running[0].done:
            return
        execution, exchange = self._running
        self._running = None
        if execution.error is None:
            self._succeed(execution.output, exchange)
        else:
            self._report(execution.error, exchange)
        for waiting in self._aborting:
            waiting.reply()
        self._aborting.clear()

    def _succeed(self, output: str, exchange: PendingRequest) -> None:
        if not output:
            exchange.reply()
        elif self._options.print_crlf_inside_quotes:
            exchange.reply_text(output)
        else:
            exchange.reply_text(output.removesuffix("\r\n"))

    def _report(self, error: SpelError, exchange: PendingRequest) -> None:
        if not self._aborted and self._options.error_state_after_failed_execute:
            self._condition.raise_error(error.number)
        if self._options.execute_failure == "refusal":
            exchange.refuse(self._options.execute_failure_code)
        else:
            exchange.reply_text(f"Error {error.number}: {error.text}")
