"""A simulated controller that is made when it is first used is the one that was made at once."""

import threading

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions

from robolink.errors import ConfigError


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
        EpsonSimulator().machin  # noqa: B018 - it raises


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
