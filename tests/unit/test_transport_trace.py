"""The contents of a trace, and the data that it never has."""

import pytest

from robolink.errors import TransportBrokenError
from robolink.timing import Deadline
from robolink.transport import SECRET_PLACEHOLDER, TracingTransport


class SteppedClock:
    def __init__(self):
        self.time_ns = 0

    def now_ns(self):
        self.time_ns += 1
        return self.time_ns

    def sleep(self, seconds):
        self.time_ns += int(seconds * 1e9)


class ScriptedTransport:
    """Returns the given data and keeps the data sent."""

    url = "epson+desk://cell-a?seed=1"
    identity = "epson+desk://cell-a"
    place = "cell-a"
    durable = False

    def __init__(self, *answers):
        self.clock = SteppedClock()
        self.answers = list(answers)
        self.sent = []
        self.closed = False
        self.broken = False

    def send(self, data, *, deadline, secret=False):
        if self.broken:
            raise TransportBrokenError("The cable is cut.")
        self.sent.append((data, secret))

    def receive(self, *, deadline):
        return self.answers.pop(0)

    def receive_waiting(self):
        return self.answers.pop(0) if self.answers else None

    def wait_readable(self, *, deadline):
        return bool(self.answers)

    def close(self):
        self.closed = True


@pytest.fixture
def records():
    return []


def traced(inner, records):
    return TracingTransport(inner, lambda *record: records.append(record))


def soon(transport):
    return Deadline(transport.clock, 10**9)


def test_both_directions_are_recorded_with_the_time_of_the_link_s_clock(records):
    inner = ScriptedTransport(b"#GetStatus", b",00000000001\r\n")
    link = traced(inner, records)
    link.send(b"$GetStatus\r\n", deadline=soon(link))
    link.receive(deadline=soon(link))
    link.receive_waiting()
    assert [record[1:] for record in records] == [
        ("sent", b"$GetStatus\r\n"),
        ("received", b"#GetStatus"),
        ("received", b",00000000001\r\n"),
    ]
    times_ns = [record[0] for record in records]
    assert times_ns == sorted(set(times_ns))


@pytest.mark.fault("F71")
def test_a_secret_leaves_one_fixed_placeholder_and_goes_out_as_it_is(records):
    inner = ScriptedTransport()
    link = traced(inner, records)
    link.send(b"$Login,hunter2\r\n", deadline=soon(link), secret=True)
    link.send(b"$Login,\r\n", deadline=soon(link), secret=True)
    assert [record[2] for record in records] == [SECRET_PLACEHOLDER] * 2
    assert inner.sent == [(b"$Login,hunter2\r\n", True), (b"$Login,\r\n", True)]


def test_what_may_have_gone_out_is_recorded_even_when_sending_fails(records):
    inner = ScriptedTransport()
    inner.broken = True
    link = traced(inner, records)
    with pytest.raises(TransportBrokenError):
        link.send(b"$Abort\r\n", deadline=soon(link))
    assert [record[1:] for record in records] == [("sent", b"$Abort\r\n")]


def test_nothing_waiting_leaves_no_record_but_the_end_of_the_stream_does(records):
    link = traced(ScriptedTransport(), records)
    assert link.receive_waiting() is None
    assert records == []
    link = traced(ScriptedTransport(b""), records)
    assert link.receive_waiting() == b""
    assert records[0][1:] == ("received", b"")


def test_a_traced_link_is_otherwise_the_link_itself(records):
    inner = ScriptedTransport(b"x")
    link = traced(inner, records)
    assert (link.url, link.identity, link.durable, link.clock) == (
        inner.url,
        inner.identity,
        inner.durable,
        inner.clock,
    )
    assert link.wait_readable(deadline=soon(link))
    link.close()
    assert inner.closed
    assert records == []
