"""From a history that breaks a rule to the shortest one that still does, and to a test of it."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

from robolink_simulators.soak.history import Disturbance, Habit, History, Hour
from robolink_simulators.soak.running import live_through
from robolink_simulators.soak.story import Story

MOST_RUNS: Final = 200
"""After so many histories it is short enough."""

Run = Callable[[History], Story]


def shrink(history: History, rule: str, *, run: Run = live_through) -> History:
    """Return a shorter history that still breaks a rule.

    Hours are left out first, then disturbances; each draws chance of its own, so what stays is as
    it was. A history that does not break it is returned as it is.

    Args:
        history: The one that was found.
        rule: Name of the rule that it breaks.
        run: How a history is run, with the same replacements as when it was found.
    """
    left = MOST_RUNS

    def breaks(candidate: History) -> bool:
        nonlocal left
        left -= 1
        return any(one.rule == rule for one in run(candidate).broken)

    found = run(history).broken
    hour = next((one.hour for one in found if one.rule == rule), None)
    if hour is None:
        return history
    shortest = history.without_hours([h.number for h in history.hours if h.number > hour])
    changed = True
    while changed and left > 0:
        changed = False
        for candidate in _shorter(shortest):
            if left <= 0:
                break
            if breaks(candidate):
                shortest, changed = candidate, True
                break
    return shortest


def _shorter(history: History) -> Iterator[History]:
    """Yield histories that lack something, those that lack most first."""
    earlier = [hour.number for hour in history.hours[:-1]]
    size = len(earlier)
    while size:
        for start in range(0, len(earlier), size):
            yield history.without_hours(earlier[start : start + size])
        size //= 2
    for at, hour in enumerate(history.hours):
        for drop in range(len(hour.disturbances)):
            kept = (*hour.disturbances[:drop], *hour.disturbances[drop + 1 :])
            hours = list(history.hours)
            hours[at] = replace(hour, disturbances=kept)
            yield replace(history, hours=tuple(hours))
        if hour.habit != Habit():
            hours = list(history.hours)
            hours[at] = replace(hour, habit=Habit())
            yield replace(history, hours=tuple(hours))


def as_test(history: History, rule: str) -> str:
    """Return a test file, in Python, that runs a history and demands that every rule holds."""
    hours = "".join(_hour(hour) for hour in history.hours)
    return f'''"""Found by the adversary under seed {history.seed}: {rule} did not hold."""

from robolink_simulators.soak import live_through
from robolink_simulators.soak.history import (
    CellKind,
    Deed,
    Disturbance,
    Habit,
    Hindrance,
    History,
    Hour,
)

HISTORY = History(
    {history.seed},
    CellKind.{history.kind.name},
    ({hours}
    ),
)


def test_every_rule_holds():
    assert live_through(HISTORY).broken == []
'''


def _hour(hour: Hour) -> str:
    disturbances = "".join(_disturbance(one) for one in hour.disturbances)
    return f"""
        Hour(
            {hour.number},
            Deed.{hour.deed.name},
            {hour.habit!r},
            ({disturbances}),
            {hour.line!r},
        ),"""


def _disturbance(one: Disturbance) -> str:
    return (
        f"\n                Disturbance(Hindrance.{one.kind.name}, {one.what!r}, {one.match!r}, "
        f"{one.at}, {one.seconds!r}, {one.position!r}),"
    )
