"""Whole cells with seeded disturbances: a sample; ``make soak`` runs many more."""

import os
import subprocess
import sys

import pytest

from tests.soak.adversary import CellKind, live_through, run
from tests.soak.adversary.history import Deed, Disturbance, Habit, Hindrance, History, Hour

HOURS = 10
STOP = Disturbance(Hindrance.STOP, match="lock 2103", seconds=0.01)
TWO_STOPS = History(
    371,
    CellKind.SOFTMOTION,
    (Hour(1, Deed.CHANGE_NOZZLE, Habit("ben"), (STOP, STOP)),),
)
"""Seed 371 as drawn when it was found."""


@pytest.mark.parametrize("seed", range(4))
def test_every_rule_holds_in_forty_disturbed_hours(seed):
    story = run(seed, HOURS)
    assert story.broken == [], story.told()
    assert story.hours == HOURS
    assert sum(story.met.values()) >= HOURS // 2  # they occurred, and were not only drawn


def test_two_threads_that_stop_a_plc_at_once_are_both_told_of_rest():
    """The second stop ended the first, whose caller was told while the robot was braking."""
    story = live_through(TWO_STOPS)
    assert story.broken == [], story.told()
    assert story.checks["AtRestWhenStopped"] >= 2, "as it was drawn"


def test_one_seed_is_one_history():
    first = run(5, 1)
    assert run(5, 1).hash == first.hash
    assert run(6, 1).hash != first.hash


@pytest.mark.soak
def test_one_seed_is_one_history_in_every_process():
    program = "from tests.soak.adversary import run; print(run(5, 1).hash, run(6, 1).hash)"
    told = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONHASHSEED": "12345"},
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    here = run(5, 1).hash, run(6, 1).hash
    assert told.split() == [*here]
    assert len(set(here)) == 2


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("first", range(1000, 1050, 5))
def test_every_rule_holds_in_a_thousand_disturbed_hours(first):
    for seed in range(first, first + 5):
        story = run(seed, 20)
        assert story.broken == [], story.told()
