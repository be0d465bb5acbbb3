"""Simulated time."""

import threading

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock, SteeredClock

from robolink.errors import ConfigError


def test_a_manual_clock_stands_still_until_someone_waits():
    clock = ManualClock(5)
    assert clock.now_ns() == clock.now_ns() == 5
    clock.sleep(0.25)
    assert clock.now_ns() == 250_000_005


def test_a_manual_clock_never_goes_back():
    clock = ManualClock(100)
    clock.advance_to(50)
    clock.sleep(-1)
    assert clock.now_ns() == 100
    with pytest.raises(ConfigError, match="cannot go back"):
        clock.advance(-1)


def test_no_tick_is_lost_when_threads_advance_a_manual_clock():
    clock = ManualClock()

    def tick():
        for _ in range(2000):
            clock.advance(1e-9)

    threads = [threading.Thread(target=tick) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.now_ns() == 8000


def test_a_scaled_clock_runs_faster_than_its_base():
    base = ManualClock(1_000)
    clock = ScaledClock(20, base)
    base.advance(1)
    assert clock.now_ns() == 1_000 + 20_000_000_000


def test_sleeping_on_a_scaled_clock_takes_less_real_time():
    base = ManualClock()
    ScaledClock(4, base).sleep(2)
    assert base.now_ns() == 500_000_000


def test_real_seconds_until_a_simulated_instant():
    base = ManualClock()
    clock = ScaledClock(10, base)
    assert clock.real_seconds(5_000_000_000) == 0.5
    assert clock.real_seconds(5_000_000_000, 3_000_000_000) == 0.2
    assert SteeredClock(10, base).real_seconds(5_000_000_000, 3_000_000_000) == 0.2
    base.advance(1)
    assert clock.real_seconds(5_000_000_000) == 0.0
    assert clock.real_seconds(5_000_000_000, 3_000_000_000) == 0.2


@pytest.mark.parametrize("factor", [0, -1, float("inf"), float("nan")])
def test_a_factor_must_be_above_zero(factor):
    with pytest.raises(ConfigError, match="factor"):
        ScaledClock(factor)
