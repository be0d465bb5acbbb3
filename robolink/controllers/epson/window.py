"""Statements run through Execute, as if typed in the controller's command window."""

from contextlib import AbstractContextManager
from functools import lru_cache
from types import TracebackType

from robolink.controllers.epson.answers import (
    NOT_EXECUTED,
    NOT_NOW,
    rejected,
    require_ready,
    status_from_flags,
)
from robolink.controllers.epson.session import EpsonSession, execution
from robolink.errors import (
    ControllerFaultError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
    UnclearAnswerError,
)
from robolink.messages import tr
from robolink.model import (
    ControllerStatus,
)
from robolink.protocols import spel
from robolink.protocols.epson_text import Refusal, Reply, parse_status
from robolink.protocols.spel import Statement

_NOT_READY = 20
_FIRST_QUESTION, _QUESTIONS = 9, 90
"""Questions are numbered 10 to 99, of the same length each."""


class CommandWindow:
    """Runs typed SPEL+ statements that do not move the robot, and explains failures.

    How a failed statement is answered is not documented (docs/reference/epson.md 1.5): anything but
    ``0`` for a command, or but printed text for a query, counts as failure, and the status tells
    the rest.
    """

    def __init__(self, session: EpsonSession) -> None:
        self._session = session
        self._was_ready = False
        self._gap: str | None = None
        self._gap_known = False
        self._asked = 0

    def status(self) -> ControllerStatus:
        """Read the flags; allowed at any time after the login."""
        return _status(self._session.exchange("GetStatus"))

    def require_ready(self, request: str) -> ControllerStatus:
        """Read the flags and refuse ``request`` if Execute would be refused.

        Raises:
            NotReadyError: Names the condition.
        """
        self._was_ready = False
        status = self.status()
        require_ready(status, controller=self._session.identity, request=request)
        self._was_ready = True
        return status

    def require_abort(self) -> None:
        """Refuse what could not be ended over this line once it runs.

        While a statement runs, Abort alone ends it (docs/reference/epson.md 1.5), and no manual
        prints its letter on Remote RS232 (docs/reference/epson.md 2.2).

        Raises:
            NotReadyError: This line has no Abort.
        """
        if self._session.carries("Abort"):
            return
        raise NotReadyError(
            tr("A movement started over this serial line could not be stopped over it."),
            reason=NotReadyReason.NO_ABORT,
            remedy=tr(
                "Nothing was sent. Move over Remote Ethernet, or see docs/remote-rs232.md for "
                "letters=guessed."
            ),
        )

    def proving_ready(self, request: str) -> AbstractContextManager[None]:
        """Refuse ``request`` unless the queries of a block are answered.

        Execute needs what :meth:`require_ready` looks for (docs/reference/epson.md 1.2), so an
        answer proves it, and later than the flags could. So they are read first only until they
        once were right: nothing is sent to a controller that was not seen ready. They are read
        again when a query is refused, to name what is missing; and before each query where no list
        can be read, since only a list shows whose answer it is.

        Raises:
            NotReadyError: Names the condition.
        """
        return _ProvingReady(self, request)

    @property
    def proves_ready(self) -> bool:
        """Whether an answer proves that the controller is ready, which it was when seen last."""
        return self._was_ready and not (self._gap_known and self._gap is None)

    def command(self, statement: Statement) -> None:
        """Run a statement that prints nothing.

        Raises:
            RejectedError: It was refused and not carried out.
            ControllerFaultError: It failed and put the controller in error.
            UnclearAnswerError: The answer says neither.
        """
        self.check(statement, self._session.ask(execution(statement)))

    def printed(self, query: Statement, *, may_be_nothing: bool = False) -> str:
        """Run a statement that prints, and return what it printed.

        Args:
            query: The statement.
            may_be_nothing: Whether printing nothing is an answer, as for an empty list.

        Raises:
            RejectedError, ControllerFaultError: As for :meth:`command`.
        """
        answer = self._session.ask(execution(query))
        if isinstance(answer, Reply) and answer.text is not None:
            # A failed statement may also be answered by a text; the flags would show the failure.
            if not answer.text.lstrip().startswith("!"):
                return answer.text
        elif isinstance(answer, Reply) and answer.fields == ("0",):
            if may_be_nothing:
                return ""
            raise RemoteProtocolError(
                tr("The controller printed nothing for {query}.", query=query),
                remedy=tr("This controller's SPEL+ differs from the documented one; report it."),
                controller=self._session.identity,
                request=query,
            )
        raise self.failure(query, answer, asked=True)

    def printed_numbers(self, *queries: Statement) -> tuple[str, ...]:
        """Print several numbers at one moment; one by one where lists cannot be read.

        Raises:
            RejectedError, ControllerFaultError: As for :meth:`command`.
            RemoteProtocolError: The answer is another question's.
        """
        listed = self._listed(*queries)
        told = listed and spel.split_numbers(listed, self._gap or "", len(queries))
        return told or tuple(map(self.printed, queries))

    def printed_before_point(
        self, *numbers: Statement, point: Statement
    ) -> tuple[tuple[str, ...], str]:
        """Print numbers and a point; see :meth:`printed_numbers`."""
        listed = self._listed(*numbers, point)
        told = listed and spel.split_before_point(listed, self._gap or "", len(numbers))
        return told or (tuple(map(self.printed, numbers)), self.printed(point))

    def _listed(self, *queries: Statement) -> str | None:
        """Print a list, and return it; ``None`` where this controller's lists cannot be read.

        A number at its end shows that it answers this question: Remote Ethernet has no other sign
        of that (docs/reference/epson.md 1.1), and all looks ask for the same.
        """
        if self._gap_of_lists() is None:
            return None
        self._asked = self._asked % _QUESTIONS + 1
        own = _FIRST_QUESTION + self._asked
        text = self.printed(spel.print_several(*queries, spel.print_number(own)))
        listed = spel.before_last_number(text, own)
        if listed is None:
            raise self._session.disowned(text)
        return listed

    def _gap_of_lists(self) -> str | None:
        """Return what this controller prints for a comma, learnt once a connection."""
        if not self._gap_known:
            # An answer to nothing would teach a wrong form; it shows before the flags do.
            self.status()
            try:
                self._gap = spel.gap_in_known_numbers(self.printed(spel.print_known_numbers()))
            except RejectedError as error:
                if error.code in NOT_NOW:
                    raise
            self._gap_known = True
        return self._gap

    def check(self, statement: Statement, answer: Reply | Refusal) -> None:
        """Raise unless ``answer`` says that ``statement`` ran."""
        if not (isinstance(answer, Reply) and answer.text is None and answer.fields == ("0",)):
            raise self.failure(statement, answer)

    def failure(
        self, statement: Statement, answer: Reply | Refusal, *, asked: bool = False
    ) -> RejectedError | ControllerFaultError | UnclearAnswerError:
        """Find out what happened to ``statement``, which had no proper answer.

        Args:
            statement: What was sent.
            answer: What came.
            asked: Whether it only asks, so that nothing is in doubt but its answer.
        """
        self._was_ready = False
        controller = self._session.identity
        code = answer.code if isinstance(answer, Refusal) else 0
        # Code 20 means that a condition is missing; the flags show which (docs/reference/epson.md
        # 1.6).
        if code in NOT_EXECUTED and code != _NOT_READY and isinstance(answer, Refusal):
            return rejected(answer, controller=controller, request=statement)
        status = self.status()
        if status.fault or status.emergency_stop or status.guard_open or status.serious_fault:
            return self.fault(status, statement)
        if code in NOT_EXECUTED and isinstance(answer, Refusal):
            return rejected(answer, controller=controller, request=statement)
        if asked:
            return RejectedError(
                tr("The controller did not answer {statement!r}.", statement=statement),
                code=code or status.code,
                remedy=tr("It said: {answer}.", answer=_shown(answer)),
                controller=controller,
                request=statement,
            )
        return UnclearAnswerError(
            tr(
                "The answer to {statement!r} says neither that it ran nor that it was refused: "
                "{answer}.",
                statement=statement,
                answer=_shown(answer),
            ),
            remedy=tr(
                "Nothing was repeated. Check what it should have changed before you continue."
            ),
            controller=controller,
            request=statement,
        )

    def fault(self, status: ControllerStatus, statement: str) -> ControllerFaultError:
        """Return the error for a controller that stopped ``statement``."""
        if status.emergency_stop:
            cause, remedy = tr("the emergency stop was pressed"), tr("Release it, then reset.")
        elif status.guard_open:
            cause, remedy = tr("the safety guard was opened"), tr("Close it, then reset.")
        else:
            cause = tr("error {code:04d}", code=status.code)
            text = self.error_text(status.code)
            cause = f"{cause} ({text})" if text else cause
            remedy = tr(
                "Remove the cause, then run 'robolink robot reset'. It can switch outputs off."
            )
        return ControllerFaultError(
            tr(
                "The controller ended {statement!r}: {cause}.",
                statement=statement,
                cause=cause,
            ),
            code=status.code,
            remedy=tr("Nothing was repeated. {remedy}", remedy=remedy),
            controller=self._session.identity,
            request=statement,
        )

    def error_text(self, code: int) -> str:
        """Return the controller's own text for ``code``, empty where it has none.

        GetErrMsg exists on newer firmware only (docs/reference/epson.md 1.8); older ones refuse it.
        """
        if not code or (self._session.pending and self._session.pending.answer is None):
            return ""
        try:
            reply = self._session.exchange("GetErrMsg", str(code), "0")
        except RejectedError:
            return ""
        return ",".join(reply.fields).strip()


class _ProvingReady:
    """See :meth:`CommandWindow.proving_ready`. No generator: every look at the arm is made in one.

    Args:
        window: Where the queries are made.
        request: What is refused.
    """

    __slots__ = ("_request", "_window")

    def __init__(self, window: CommandWindow, request: str) -> None:
        self._window, self._request = window, request

    def __enter__(self) -> None:
        if not self._window.proves_ready:
            self._window.require_ready(self._request)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if isinstance(error, (RejectedError, ControllerFaultError)):
            self._window.require_ready(self._request)


@lru_cache(maxsize=256)
def _status(reply: Reply) -> ControllerStatus:
    """Read a status; a poll sees the same few over and over."""
    return status_from_flags(*parse_status(reply))


def _shown(answer: Reply | Refusal) -> str:
    if isinstance(answer, Refusal):
        return f"!{answer.name},{answer.code}"
    said = f'"{answer.text}"' if answer.text is not None else ",".join(answer.fields)
    return f"#{answer.name},{said}"
