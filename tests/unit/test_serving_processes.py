"""Background work of a serving process: garbage, ready sockets, deferred creation."""

import gc
import json
import select
import selectors
import socket
import subprocess
import sys
import threading
from collections import deque

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.hosting.streams.serving_loop import (
    QueuedReadiness,
    SelectedReadiness,
    make_readiness,
)

import robolink
from robolink.errors import ConfigError

# A serving process collects garbage so that old objects are hardly ever examined.

COLLECTED = """
import gc
from weakref import ref

from robolink_simulators.hosting.garbage import RareFullCollections


class Ring:
    def __init__(self):
        self.itself = self


gc.disable()
before = list(gc.callbacks)
with RareFullCollections(spare=0) as collections:
    at_first = gc.get_freeze_count()
    rings = [Ring() for _ in range(500)]
    seen = [ref(ring) for ring in rings]
    gc.collect(0)
    assert gc.get_freeze_count() == at_first, "one of the youngest alone sets nothing aside"
    gc.collect(1)
    assert gc.get_freeze_count() >= at_first + 500, "what survives is set aside"
    rings.clear()
    gc.collect()
    assert sum(ring() is not None for ring in seen) == 500, "and not looked at"
    more = [[] for _ in range(2 * at_first)]
    del more
    gc.collect(1)
    assert collections.thaws == 0, "what has gone by itself does not count"
    more = [[] for _ in range(at_first)]
    gc.collect(1)
    assert (collections.thaws, gc.get_freeze_count()) == (1, 0), "until it is twice what it was"
    gc.collect(1)
    assert gc.get_freeze_count() == 0, "then nothing is set aside"
    gc.collect()
    assert sum(ring() is not None for ring in seen) == 0, "before its garbage is found"
    in_use = gc.get_freeze_count()
    assert in_use >= 2 * at_first
    more += [[] for _ in range(in_use // 2)]
    gc.collect(1)
    gc.collect()
    assert collections.thaws == 1, "and what was found in use is what counts from then on"
assert (gc.get_freeze_count(), gc.callbacks) == (0, before), "at the end all is as it was"

usual = gc.get_threshold()
gc.set_threshold(10_000, 10, 10)
with RareFullCollections():
    assert (gc.get_freeze_count(), gc.callbacks) == (0, before), "somebody else has decided"
gc.set_threshold(*usual)

gc.freeze()
count = gc.get_freeze_count()
with RareFullCollections():
    assert (gc.get_freeze_count(), gc.callbacks) == (count, before), "somebody else has decided"
assert gc.get_freeze_count() == count
"""


def collector():
    """The collector's settings; frozen objects may go by themselves."""
    return list(gc.callbacks), gc.get_threshold(), gc.isenabled()


@pytest.fixture
def nothing_set_aside():
    """As in a process that has left its collector alone; this one has not."""
    enabled, threshold = gc.isenabled(), gc.get_threshold()
    gc.disable()
    gc.unfreeze()
    gc.set_threshold(700, 10, 10)
    yield
    gc.set_threshold(*threshold)
    gc.freeze()
    if enabled:
        gc.enable()


def test_what_survives_is_set_aside_and_looked_at_again_once_it_has_doubled():
    # In a separate process: this one holds all the tests.
    subprocess.run([sys.executable, "-c", COLLECTED], check=True, timeout=60)


def test_a_cell_inside_of_a_program_leaves_its_collector_alone(nothing_set_aside):
    before = collector()
    with serve_tcp(EpsonSimulator()) as host, robolink.connect(host.url) as other:
        other.status()
        assert collector() == before
        assert gc.get_freeze_count() == 0
    with robolink.connect("epson+sim://collector?seed=1") as controller:
        controller.status()
        assert collector() == before
        assert gc.get_freeze_count() == 0


SERVING = """
import gc
import json
import sys

from robolink_cli import main

looks = []


class Looking:
    encoding, errors = "utf-8", "strict"

    def write(self, text):
        looks.append((text if isinstance(text, str) else text.decode(), gc.get_freeze_count()))
        return len(text)

    def flush(self):
        pass

    def isatty(self):
        return False


# As in a process that has left its collector alone; the one that was forked has not.
gc.unfreeze()
gc.set_threshold(700, 10, 10)
shown, sys.stdout = sys.stdout, Looking()
code = main.run(sys.argv[1:])
sys.stdout = shown
print(json.dumps([code, looks, gc.get_freeze_count()]))
"""


@pytest.mark.parametrize("of_a_file", [False, True])
def test_commands_that_serve_set_aside_while_they_serve(of_a_file, tmp_path):
    """The first line is printed once everything is served.

    In a separate process, for this one holds all the tests.
    """
    cells = tmp_path / "cells.toml"
    cells.write_text(
        'schema = "robolink/sim-cells/1"\n[cells.one]\nkind = "epson"\ntcp = "127.0.0.1:0"\n',
        encoding="utf-8",
    )
    what = ["run", str(cells)] if of_a_file else ["epson", "--tcp", "127.0.0.1:0"]
    words = ["sim", *what, "--idle-exit", "0.1", "--json"]
    told = subprocess.run(
        [sys.executable, "-m", "tests._program", SERVING, *words],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout
    code, looks, left = json.loads(told)
    first, set_aside = next((text, count) for text, count in looks if text)
    assert code == 0
    assert json.loads(first)["simulated"]
    assert set_aside > 1000
    assert left == 0


# Readiness of sockets: nobody misses a turn, whichever means of the system is used.

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


# A simulated controller created at its first use equals one created at once.


def test_nothing_of_a_controller_is_made_before_somebody_uses_it():
    simulator = EpsonSimulator(seed=3)
    simulator.advance(5_000_000_000)
    assert simulator.next_change() is None
    assert "machine" not in vars(simulator)
    assert simulator.machine.arm.now_ns == 5_000_000_000


def test_when_it_is_made_changes_nothing_of_its_world():
    early, late = (EpsonSimulator(seed=3, serial="SIM00003") for _ in range(2))
    before = early.truth()
    late.advance(60_000_000_000)
    assert late.truth() == before
    assert late.machine_name == early.machine_name
    assert late.counters() == early.counters()


def test_threads_that_use_it_first_at_one_time_use_one_machine():
    simulator, gate, seen = EpsonSimulator(seed=3), threading.Barrier(4), []

    def look():
        gate.wait()
        seen.append((simulator.machine, simulator.worlds, simulator.panel))

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({tuple(map(id, parts)) for parts in seen}) == 1


def test_what_it_has_not_is_named():
    with pytest.raises(AttributeError, match="machin"):
        EpsonSimulator().machin  # type: ignore[attr-defined]  # noqa: B018 - it raises


def test_a_state_file_that_does_not_fit_is_refused_at_once(tmp_path):
    (tmp_path / "state.json").write_text("{}")
    with pytest.raises(ConfigError, match="not a saved state"):
        EpsonSimulator(state_path=tmp_path / "state.json")


@pytest.mark.parametrize("silence", [False, True])
def test_a_request_that_silence_ends_is_waited_for(login, silence):
    simulator = EpsonSimulator(options=EpsonOptions(requests_end_with_silence=silence))
    client = login(simulator)
    simulator.advance(1_000_000_000)
    client.link.receive(b"$GetStatus", 1_000_000_000)
    expected = 1_100_000_000 if silence else 60_000_000_000
    assert simulator.next_change() == expected


def test_nothing_is_waited_for_once_the_client_has_gone(login):
    simulator = EpsonSimulator()
    client = login(simulator)
    simulator.advance(1_000_000_000)
    assert simulator.next_change() == 60_000_000_000
    client.link.receive(b"", 1_000_000_000)
    simulator.advance(1_000_000_000)
    assert simulator.next_change() is None
