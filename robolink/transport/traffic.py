"""Reports the traffic of a link to listeners, without its secrets.

Every link tells its traffic here: byte streams (EPSON, Modbus, anybody's) through
:class:`~robolink.transport.TracingTransport`, a CAN bus frame by frame, a mailbox without bytes
word by word, and a kind of controller that has a link of its own through its stop latch. So a
secret is hidden here, and nowhere else: from the ``trace`` of a connection and from the log alike.

A secret that was bent on its way may come back in the answer that refuses it. So of what comes
between a secret and the next request only those answers are told that are known to hold none; and
what repeats six characters of it later is not told either.
"""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import wraps
from threading import local
from typing import Final, Literal, ParamSpec, TypeVar

from robolink.messages import tr
from robolink.package_log import PackageLog, complain
from robolink.timing import Clock

Direction = Literal["sent", "received"]

TraceSink = Callable[[int, Direction, bytes], None]
"""Receives the time in ns of the link's clock, the direction and the bytes."""

SECRET_PLACEHOLDER: Final = b"<secret>"
"""Replaces every secret in a trace, whatever its content and length."""

PACKAGE_LOG: Final = PackageLog(__package__)

_RUN: Final = 6
"""Number of successive characters of a secret that are never shown."""

_SHORTEST: Final = 4

_TEXT: Final = bytes(range(0x20, 0x7F)) + b"\t\r\n"


class Listeners:
    """Who receives the traffic of the links that a block opens; see :func:`told_to`.

    Attributes:
        sinks: Each is told of all traffic.
        links: The traffic of each link.
    """

    def __init__(self, sinks: tuple[TraceSink, ...] = ()) -> None:
        self.sinks = sinks
        self.links: list[Traffic] = []

    @property
    def count(self) -> int:
        """The bytes sent and received on all links so far."""
        return sum(link.count for link in self.links)


class _ThisThread(local):
    """Who receives the traffic of what this thread opens."""

    listeners: Listeners | None = None


_here: Final = _ThisThread()

_P = ParamSpec("_P")
_R = TypeVar("_R")


@contextmanager
def told_to(*sinks: TraceSink | None) -> Iterator[Listeners]:
    """Report the traffic of each link that the block opens to ``sinks``.

    A kind of controller passes nothing on for that, so none can forget to.

    Args:
        sinks: Each is told of all traffic; ``None`` is left out.

    Example:
        >>> from robolink.transport import open_transport, told_to
        >>> from robolink.timing import Deadline
        >>> told = []
        >>> with told_to(lambda at_ns, direction, data: told.append((direction, data))):
        ...     line = open_transport("epson+sim://told-example")
        >>> line.send(b"$GetStatus", deadline=Deadline.after(line.clock, 1))
        >>> told
        [('sent', b'$GetStatus')]
        >>> line.close()
    """
    outer, given = _here.listeners, tuple(sink for sink in sinks if sink is not None)
    listeners = Listeners(given if outer is None else (*outer.sinks, *given))
    _here.listeners = listeners
    try:
        yield listeners
    finally:
        _here.listeners = outer
        if outer is not None:
            outer.links += listeners.links


def present_listeners() -> Listeners | None:
    """Return who receives the traffic of links that are opened now; ``None`` outside of a block."""
    return _here.listeners


def told_alike(opened: Callable[_P, _R]) -> Callable[_P, _R]:
    """Report the traffic of a link that is opened later to the present listeners.

    Args:
        opened: Opens it.
    """
    listeners = _here.listeners

    @wraps(opened)
    def opened_later(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        before, _here.listeners = _here.listeners, listeners
        try:
            return opened(*args, **kwargs)
        finally:
            _here.listeners = before

    return opened_later


class Traffic:
    """Reports the traffic of one link to the trace of its connection and to the log.

    It is told to whoever was given to :func:`told_to` when it was made. What listens and fails is
    told no more, and said once on standard error: the dialogue goes on.

    Args:
        controller: Identity of the far end.
        clock: Of the link.
        sinks: Told in addition.
        log: Logger of the package that moves the bytes; ``None`` logs nothing.

    Attributes:
        count: The bytes sent and received so far. The link adds them, whether anybody listens or
            not.

    Example:
        >>> from robolink.timing import SystemClock
        >>> from robolink.transport import Traffic
        >>> sink = lambda at_ns, direction, data: print(direction, data)
        >>> traffic = Traffic("acme+usb://17", SystemClock(), sinks=(sink,))
        >>> traffic.sent(b"LOGIN swordfish", secret=True)
        sent b'<secret>'
        >>> traffic.received(b"NO swordfish")
        received b'<secret>'
        >>> traffic.sent(b"STATUS")
        sent b'STATUS'
    """

    def __init__(
        self,
        controller: str,
        clock: Clock,
        *,
        sinks: tuple[TraceSink, ...] = (),
        log: PackageLog | None = PACKAGE_LOG,
    ) -> None:
        listeners = _here.listeners
        if listeners is not None and log is not None:
            listeners.links.append(self)
            sinks = (*listeners.sinks, *sinks)
        self.controller, self.count = controller, 0
        self._clock, self._sinks, self._log = clock, sinks, log
        self._debugs = _never if log is None else log.debugs
        self._request = ""
        self._harmless: Collection[bytes] = ()
        self._runs: frozenset[bytes] = frozenset()
        self._answer: bytes | None = None
        self._tail = b""

    @property
    def logs(self) -> bool:
        """Whether it writes to the log, if anybody reads that."""
        return self._log is not None

    def listened(self) -> bool:
        """Whether anybody listens; a link checks this before it reports traffic."""
        return True if self._sinks else self._debugs()

    def show_answers(self, answers: Collection[bytes]) -> None:
        """Name the answers to a secret that hold none of it, so that they are shown as they are.

        Args:
            answers: Each whole, with its line end.
        """
        self._harmless = answers

    def sent(self, data: bytes, *, secret: bool = False, request: str = "") -> None:
        """Report what is sent now.

        Args:
            data: The bytes.
            secret: Whether they hold a password.
            request: What it is, where that is known better than from the bytes.

        Example:
            >>> from robolink.timing import SystemClock
            >>> from robolink.transport import Traffic
            >>> sink = lambda at_ns, direction, data: print(direction, data)
            >>> traffic = Traffic("acme+usb://17", SystemClock(), sinks=(sink,))
            >>> traffic.sent(b"LOGIN swordfish", secret=True)
            sent b'<secret>'
        """
        if secret:
            self._answer, self._tail = b"", b""
            self._runs = frozenset(data[at : at + _RUN] for at in range(len(data) - _RUN + 1))
            data = SECRET_PLACEHOLDER
        else:
            self._answer = None
        if self.listened():
            self._request = request or as_logged(data)
            self._tell("sent", data)

    def received(self, data: bytes, *, request: str = "") -> None:
        """Report what was received; empty is the end of the stream.

        Args:
            data: The bytes.
            request: What it answers, where that is known better than from what was sent last.
        """
        if self.listened():
            self._request = request or self._request
            self._tell("received", SECRET_PLACEHOLDER if self._holds_secret(data) else data)

    def _holds_secret(self, data: bytes) -> bool:
        if not self._runs or not data:
            return False
        if self._answer is not None:
            self._answer = self._beyond_harmless(self._answer + data)
            return not any(answer.startswith(self._answer) for answer in self._harmless)
        joined = self._tail + data
        self._tail = joined[1 - _RUN :]
        return any(joined[at : at + _RUN] in self._runs for at in range(len(joined) - _RUN + 1))

    def _beyond_harmless(self, answer: bytes) -> bytes:
        """Return what is left of an answer without the whole ones that hold no secret."""
        while answer:
            known = [one for one in self._harmless if answer.startswith(one)]
            if not known or any(one.startswith(answer) for one in self._harmless):
                break
            answer = answer[max(map(len, known)) :]
        return answer

    def _tell(self, direction: Direction, data: bytes) -> None:
        if self._log is not None and self._log.debugs():
            self._log.passed(
                f"{direction} {as_logged(data)}",
                controller=self.controller,
                request=self._request,
                direction=direction,
            )
        at_ns = self._clock.now_ns() if self._sinks else 0
        for sink in self._sinks:
            try:
                sink(at_ns, direction, data)
            except Exception as error:
                self._sinks = tuple(one for one in self._sinks if one is not sink)
                complain(tr("The dialogue is recorded no further. {cause}", cause=error))


def _never() -> bool:
    return False


def repeats(secret: str, data: bytes) -> bool:
    """Return whether an answer repeats a secret, or six characters of it.

    Args:
        secret: It; one of fewer than four characters may stand anywhere by chance.
        data: What was answered.

    Example:
        >>> from robolink.transport.traffic import repeats
        >>> repeats("canary-7413", b"!Lpgin,canary-741X,11"), repeats("13", b"!Login,13")
        (True, False)
    """
    text = secret.encode("utf-8", "replace")
    long = min(_RUN, len(text))
    return long >= _SHORTEST and any(
        text[at : at + long] in data for at in range(len(text) - long + 1)
    )


def as_logged(data: bytes) -> str:
    """Return bytes for a line of a log: text with its control characters escaped, else digits.

    Args:
        data: The bytes.

    Example:
        >>> from robolink.transport.traffic import as_logged
        >>> as_logged(b"$GetStatus"), as_logged(bytes([0, 1, 255])), as_logged(b"")
        ('$GetStatus', '00 01 ff', '(end)')
    """
    if not data:
        return "(end)"
    if data.translate(None, _TEXT):
        return data.hex(" ")
    return data.decode("ascii").encode("unicode_escape").decode("ascii")
