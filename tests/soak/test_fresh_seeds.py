"""Histories of fresh seeds that broke a rule, cut to the essentials: now each rule holds in them.

docs/reliability.md says of each what was wrong, in which of the two, and what holds now.
"""

import json
from pathlib import Path

import pytest

from tests.soak.adversary import drawn_history, live_through
from tests.soak.adversary.history import (
    CellKind,
    Deed,
    Disturbance,
    Habit,
    Hindrance,
    History,
    Hour,
)

FOUND = Path(__file__).with_name("found_histories.json")
"""Each disturbance is a row: kind, what, match, at, seconds, position."""


def _history(found):
    hours = (
        Hour(
            hour["number"],
            Deed(hour["deed"]),
            Habit(**hour.get("habit", {})),
            tuple(
                Disturbance(Hindrance(kind), *rest) for kind, *rest in hour.get("disturbances", ())
            ),
            tuple(hour.get("line", ())),
        )
        for hour in found["hours"]
    )
    return History(found["seed"], CellKind(found["kind"]), tuple(hours))


HISTORIES = tuple(map(_history, json.loads(FOUND.read_text(encoding="utf-8"))))
HALF_A_FILE = drawn_history(919893192, 20)
"""A PLC over Modbus TCP, and a journal whose rows came back empty."""

LOST_RECORD = drawn_history(177058577, 20).without_hours(
    [hour for hour in range(20) if hour not in (8, 9)]
)
"""A program that calls back, and a journal that somebody deleted."""
NO_HEAD = drawn_history(17250169, 20)
"""A journal that has lost the note of its last entry, and a program that calls back."""
FROZEN_PROGRAM = drawn_history(919892947, 20).without_hours(
    [hour for hour in range(20) if hour not in (1, 2, 4)]
)
"""A hand cannot select a tool while the PLC's program is stopped."""
SWAPPED = drawn_history(966517133, 20).without_hours(
    [hour for hour in range(20) if hour not in (4, 5)]
)
"""Two characters of a read-back changed places, and the disk kept the result."""


@pytest.mark.soak
@pytest.mark.parametrize(
    "history",
    [*HISTORIES, HALF_A_FILE, LOST_RECORD, NO_HEAD, FROZEN_PROGRAM, SWAPPED],
    ids=lambda history: str(history.seed),
)
def test_every_rule_holds_in_what_broke_one(history):
    story = live_through(history)
    assert story.broken == [], story.told()
