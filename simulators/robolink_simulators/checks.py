"""The transport contract as checks for any transport.

Each check takes a *maker* and needs no test framework, so a third party can run the same
checks on a transport of its own; it raises AssertionError with a sentence. A fake must pass
what the real thing passes: :data:`LONE_CHECKS` need a far end that keeps silent until it is
spoken to, :data:`PAIR_CHECKS` one that the check speaks for. How a dead cable looks is not
checked here, because no maker can cut one.
"""

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from robolink.errors import RobolinkError, TransportClosedError, TransportTimeoutError
from robolink.timing import Deadline
from robolink.transport import Transport, parse_url

_PATIENCE_S = 5.0


class FarEnd(Protocol):
    """The other end of a transport, controlled by a check."""

    def send(self, data: bytes) -> None:
        """Send all of ``data`` to the transport."""

    def receive_exactly(self, count: int) -> bytes:
        """Return the next ``count`` bytes from the transport."""

    def close(self) -> None:
        """End the connection in an orderly way."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A transport and its far end, connected."""

    near: Transport
    far: FarEnd


LoneMaker = Callable[[], AbstractContextManager[Transport]]
PairMaker = Callable[[], AbstractContextManager[Pair]]


def check_identity_is_the_url_without_options(make: LoneMaker) -> None:
    """What names the far end in records must not change with an option."""
    with make() as near:
        _require(near.identity == parse_url(near.url).identity, "identity is not the bare URL")


def check_silence_times_out(make: LoneMaker) -> None:
    """A far end that says nothing is a time-out, never an end of stream."""
    with make() as near:
        _expect(TransportTimeoutError, lambda: near.receive(deadline=_soon(near)))


def check_silence_is_nothing_waiting(make: LoneMaker) -> None:
    """Looking for waiting bytes returns at once, and None is not an end of stream."""
    with make() as near:
        _require(near.receive_waiting() is None, "bytes came from nowhere")


def check_silence_is_not_readable(make: LoneMaker) -> None:
    """Waiting for readability ends at its deadline."""
    with make() as near:
        _require(not near.wait_readable(deadline=_soon(near)), "silence was called readable")


def check_closing_twice_is_harmless(make: LoneMaker) -> None:
    """Close is idempotent."""
    with make() as near:
        near.close()
        near.close()


def check_a_closed_transport_says_so(make: LoneMaker) -> None:
    """Every use after close is an error of its own, and readable at once."""
    with make() as near:
        near.close()
        later = _soon(near)
        _expect(TransportClosedError, lambda: near.send(b"x", deadline=later))
        _expect(TransportClosedError, lambda: near.receive(deadline=later))
        _expect(TransportClosedError, near.receive_waiting)
        _require(near.wait_readable(deadline=later), "a closed transport would keep one waiting")


def check_bytes_arrive_in_order_both_ways(make: PairMaker) -> None:
    """What is sent arrives, all of it, in order, nothing added."""
    data = bytes(range(256)) * 512
    with make() as pair:
        sender = threading.Thread(target=pair.far.send, args=(data,))
        sender.start()
        _require(_collect(pair.near, len(data)) == data, "bytes were changed on the way in")
        sender.join()
        sender = threading.Thread(
            target=pair.near.send, args=(data,), kwargs={"deadline": _late(pair.near)}
        )
        sender.start()
        _require(pair.far.receive_exactly(len(data)) == data, "bytes were changed on the way out")
        sender.join()


def check_secret_bytes_are_sent_as_they_are(make: PairMaker) -> None:
    """Secrecy concerns records, not the wire."""
    with make() as pair:
        pair.near.send(b"$Login,x\r\n", deadline=_late(pair.near), secret=True)
        _require(pair.far.receive_exactly(10) == b"$Login,x\r\n", "a secret send was altered")


def check_an_orderly_end_is_an_end_of_stream(make: PairMaker) -> None:
    """After the last byte comes ``b""``, from both ways of reading, again and again."""
    with make() as pair:
        pair.far.send(b"bye")
        pair.far.close()
        _require(_collect(pair.near, 3) == b"bye", "the last bytes were lost")
        _require(pair.near.wait_readable(deadline=_late(pair.near)), "the end is not readable")
        for _ in range(2):
            _require(pair.near.receive(deadline=_late(pair.near)) == b"", "no end of stream")
            _require(pair.near.receive_waiting() == b"", "no end of stream when only looking")


def check_waiting_for_readability_consumes_nothing(make: PairMaker) -> None:
    """Another thread may wait while the owner reads."""
    with make() as pair:
        pair.far.send(b"hello")
        for _ in range(2):
            _require(pair.near.wait_readable(deadline=_late(pair.near)), "bytes went unnoticed")
        _require(_collect(pair.near, 5) == b"hello", "waiting consumed something")


def check_waiting_bytes_are_returned_at_once(make: PairMaker) -> None:
    """What has arrived is returned even when the deadline has passed."""
    with make() as pair:
        pair.far.send(b"late")
        _require(pair.near.wait_readable(deadline=_late(pair.near)), "bytes went unnoticed")
        _require(pair.near.receive(deadline=_soon(pair.near, after_s=0)) != b"", "bytes were lost")


def check_bytes_that_trickle_in_do_not_extend_a_deadline(make: PairMaker) -> None:
    """One deadline rules a whole exchange, however many reads it takes."""
    with make() as pair:
        deadline = _soon(pair.near)
        for _ in range(3):
            pair.far.send(b".")
            pair.near.receive(deadline=deadline)
        _expect(TransportTimeoutError, lambda: _read_on(pair.near, deadline))
        _require(deadline.expired, "the time-out came before its deadline")


def check_closing_wakes_a_waiting_thread(make: PairMaker) -> None:
    """Closing in another thread ends a receive and a wait, soon."""
    with make() as pair:
        near, late = pair.near, _late(pair.near)
        ends: list[object] = []
        calls = (lambda: _read_on(near, late), lambda: near.wait_readable(deadline=late))
        threads = [threading.Thread(target=_note_end, args=(ends, call)) for call in calls]
        for thread in threads:
            thread.start()
        time.sleep(0.05)  # real time on purpose: the threads must be inside their calls
        pair.near.close()
        for thread in threads:
            thread.join(_PATIENCE_S / 2)
            _require(not thread.is_alive(), "a thread kept waiting on a closed transport")
        _require(True in ends and len(ends) == 2, f"the waits ended otherwise: {ends}")
        _require(any(isinstance(end, TransportClosedError) for end in ends), f"not closed: {ends}")


LONE_CHECKS: tuple[Callable[[LoneMaker], None], ...] = (
    check_identity_is_the_url_without_options,
    check_silence_times_out,
    check_silence_is_nothing_waiting,
    check_silence_is_not_readable,
    check_closing_twice_is_harmless,
    check_a_closed_transport_says_so,
)
"""Checks for any transport whose far end does not send first."""

PAIR_CHECKS: tuple[Callable[[PairMaker], None], ...] = (
    check_bytes_arrive_in_order_both_ways,
    check_secret_bytes_are_sent_as_they_are,
    check_an_orderly_end_is_an_end_of_stream,
    check_waiting_for_readability_consumes_nothing,
    check_waiting_bytes_are_returned_at_once,
    check_bytes_that_trickle_in_do_not_extend_a_deadline,
    check_closing_wakes_a_waiting_thread,
)
"""Checks for a transport whose far end the check itself can operate."""


def _soon(near: Transport, *, after_s: float = 0.05) -> Deadline:
    return Deadline.after(near.clock, after_s)


def _late(near: Transport) -> Deadline:
    return Deadline.after(near.clock, _PATIENCE_S)


def _collect(near: Transport, count: int) -> bytes:
    data = bytearray()
    deadline = _late(near)
    while len(data) < count:
        part = near.receive(deadline=deadline)
        _require(part != b"", "the stream ended early")
        _require(len(part) <= 65536, "more than 65536 bytes at once")
        data += part
    return bytes(data)


def _read_on(near: Transport, deadline: Deadline) -> None:
    while near.receive(deadline=deadline):
        pass


def _note_end(ends: list[object], call: Callable[[], object]) -> None:
    try:
        ends.append(call())
    except RobolinkError as error:
        ends.append(error)


def _expect(kind: type[Exception], call: Callable[[], object]) -> None:
    try:
        result = call()
    except kind:
        return
    raise AssertionError(f"expected {kind.__name__}, got {result!r}")


def _require(condition: bool, sentence: str) -> None:
    if not condition:
        raise AssertionError(sentence)
