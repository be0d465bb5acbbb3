"""What tells which sockets are ready: nobody misses a turn, by whichever of the system's means."""

import select
import selectors
import socket
from collections import deque

import pytest
from robolink_simulators.hosting.streams.serving_loop import (
    QueuedReadiness,
    SelectedReadiness,
    make_readiness,
)

EPOLL = pytest.mark.skipif(not hasattr(select, "epoll"), reason="this system has no epoll")
MANY = 100


@pytest.fixture(params=[SelectedReadiness, pytest.param(QueuedReadiness, marks=EPOLL)])
def readiness(request):
    made = request.param()
    yield made
    made.close()


@pytest.fixture
def pairs():
    """Connected pairs of sockets, closed at the end."""
    made: list[tuple[socket.socket, socket.socket]] = []

    def connected(count):
        made.extend(socket.socketpair() for _ in range(count))
        return made

    yield connected
    for pair in made:
        for end in pair:
            end.close()


def test_it_tells_who_can_be_read_and_who_can_be_written_to(readiness, pairs):
    (one, far), (other, _) = pairs(2)
    readiness.register(one, selectors.EVENT_READ, "one")
    readiness.register(other.fileno(), selectors.EVENT_READ, "other")
    assert list(readiness.ready(0.0)) == []
    far.send(b"x")
    assert list(readiness.ready(10.0)) == [("one", selectors.EVENT_READ)]
    readiness.modify(other.fileno(), selectors.EVENT_WRITE, "again")
    assert set(readiness.ready(10.0)) == {
        ("one", selectors.EVENT_READ),
        ("again", selectors.EVENT_WRITE),
    }
    readiness.unregister(one)
    readiness.unregister(other.fileno())
    assert list(readiness.ready(0.0)) == []


def test_a_connection_that_has_ended_can_be_read(readiness, pairs):
    ((one, far),) = pairs(1)
    readiness.register(one, selectors.EVENT_READ, "one")
    far.close()
    ((data, events),) = readiness.ready(10.0)
    assert data == "one"
    assert events & selectors.EVENT_READ


def test_a_number_that_was_closed_may_be_watched_again_for_somebody_else(readiness, pairs):
    ((one, far),) = pairs(1)
    readiness.register(one, selectors.EVENT_READ, "before")
    readiness.unregister(one)
    readiness.register(one, selectors.EVENT_READ, "now")
    far.send(b"x")
    assert list(readiness.ready(10.0)) == [("now", selectors.EVENT_READ)]


@EPOLL
def test_who_asks_a_moment_after_the_others_waits_for_one_round_and_not_for_two(pairs):
    """Each of the others asks again as soon as it has been answered."""
    readiness = make_readiness()
    ends = pairs(MANY)
    for number, (near, far) in enumerate(ends):
        near.setblocking(False)
        readiness.register(near, selectors.EVENT_READ, number)
        if number:
            far.send(b"?")
    served = 0
    answered = deque[int](maxlen=3 * MANY)
    while 0 not in answered:
        for number, _ in readiness.ready(10.0):
            near, far = ends[number]
            near.recv(16)
            answered.append(number)
            served += 1
            if served == 1:
                ends[0][1].send(b"?")
            far.send(b"?")
        assert served < 3 * MANY
    readiness.close()
    waited = answered.index(0)
    assert waited < 1.5 * MANY
