"""Simulators inside this process: shared by name, with the same faults as over TCP."""

import threading
from contextlib import closing

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.in_process.epson import (
    clock_of,
    open_epson,
    register,
    simulator_named,
    unregister,
)

from robolink.errors import ConfigError, TransportBrokenError, TransportTimeoutError
from robolink.timing import Deadline
from robolink.transport import open_transport, parse_url


@pytest.fixture
def name():
    yield "hosting-test"
    unregister("hosting-test")


def soon(transport, seconds=5.0):
    return Deadline.after(transport.clock, seconds)


def exchange(transport, request):
    transport.send(request, deadline=soon(transport))
    data = b""
    while not data.endswith(b"\r\n"):
        data += transport.receive(deadline=soon(transport))
    return data


def test_a_named_simulator_is_shared_by_name(name):
    first = open_transport(f"epson+sim://{name}?seed=4&rc_plus=5&robot=GX4-C251S")
    again = open_transport(f"epson+sim://{name}")
    with closing(first), closing(again):
        simulator = simulator_named(name)
        assert (simulator.seed, simulator.options.rc_plus) == (4, 5)
        assert simulator.machine.model.name == "GX4-C251S"
        assert first.clock is again.clock is clock_of(name)
        assert first.identity == again.identity == f"epson+sim://{name}"
        assert not first.durable
    with pytest.raises(ConfigError, match="other options"):
        open_transport(f"epson+sim://{name}?seed=5")


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("colour=red", "robot, seed, state, split, faults, answer_ms"),
        ("seed=x", "whole number"),
        ("robot=R2D2", "no simulated robot"),
        ("split=2", "split"),
        ("terminator=tab", "crlf"),
    ],
)
def test_a_wrong_option_is_named_and_leaves_no_simulator(name, query, words):
    with pytest.raises(ConfigError, match=words):
        open_transport(f"epson+sim://{name}?{query}")
    with pytest.raises(ConfigError, match="No simulator"):
        simulator_named(name)


def test_a_state_file_makes_it_durable(name, tmp_path):
    with closing(open_transport(f"epson+sim://{name}?state={tmp_path}/cell.json")) as transport:
        assert transport.durable


def test_waiting_lets_simulated_time_pass_and_no_more_than_needed(name):
    with closing(open_transport(f"epson+sim://{name}")) as transport:
        exchange(transport, b"$Login,\r\n")
        assert transport.clock.now_ns() == 0
        transport.send(b'$Execute,"Move Here +X(-10)"\r\n', deadline=soon(transport))
        assert not transport.wait_readable(deadline=soon(transport, 0.1))
        assert transport.clock.now_ns() == 100_000_000
        assert transport.wait_readable(deadline=soon(transport, 60))
        assert transport.receive(deadline=soon(transport)) == b"#Execute,0\r\n"
        assert transport.clock.now_ns() < 2_000_000_000
        with pytest.raises(TransportTimeoutError):
            transport.receive(deadline=soon(transport))


def test_what_arrives_may_come_in_pieces(name):
    with closing(open_transport(f"epson+sim://{name}?split=1")) as transport:
        transport.send(b"$Login,\r\n$GetStatus\r\n", deadline=soon(transport))
        pieces = [transport.receive(deadline=soon(transport))]
        while sum(len(piece) for piece in pieces) < 10 + 29:
            pieces.append(transport.receive(deadline=soon(transport)))
        assert len(pieces) > 2
        assert b"".join(pieces) == b"#Login,0\r\n#GetStatus,00100000001,0000\r\n"


def test_a_cut_link_ends_the_stream_and_breaks_the_next_send(name):
    simulator = EpsonSimulator(faults=[Fault(FaultAction.DISCONNECT, match="GetIO")])
    register(name, simulator)
    with closing(open_transport(simulator.url)) as transport:
        exchange(transport, b"$Login,\r\n")
        transport.send(b"$GetIO,0\r\n", deadline=soon(transport))
        assert transport.receive(deadline=soon(transport)) == b""
        assert transport.receive_waiting() == b""
        with pytest.raises(TransportBrokenError):
            transport.send(b"$GetIO,0\r\n", deadline=soon(transport))


def test_a_name_is_taken_once(name):
    register(name, EpsonSimulator())
    with pytest.raises(ConfigError, match="taken"):
        register(name, EpsonSimulator())


def test_a_manual_clock_of_the_caller_is_used(name):
    clock = ManualClock(77)
    with closing(open_epson(parse_url(f"epson+sim://{name}"), clock=clock)) as transport:
        assert transport.clock is clock


def test_threads_do_not_mix_their_answers(name):
    simulator = EpsonSimulator()
    register(name, simulator)
    with closing(open_transport(simulator.url)) as transport:
        exchange(transport, b"$Login,\r\n")
        stop = threading.Event()

        def press():
            while not stop.is_set():
                simulator.panel.press_estop()
                simulator.panel.release_estop()

        thread = threading.Thread(target=press)
        thread.start()
        try:
            answers = {exchange(transport, b"$GetCurRobot\r\n") for _ in range(300)}
        finally:
            stop.set()
            thread.join()
    assert answers == {b"#GetCurRobot,1\r\n"}
