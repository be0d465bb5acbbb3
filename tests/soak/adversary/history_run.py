"""Runs a history on a disk in memory, shortens one that breaks a rule, and makes a test of it."""

import gc
import os
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final
from unittest import mock

from tests.soak.adversary.cell import VirtualCell
from tests.soak.adversary.history import Disturbance, Habit, History, Hour, Story


def live_through(history: History, replacements: Mapping[str, object] | None = None) -> Story:
    """Run a history on a disk in memory, if there is one; no files remain.

    Args:
        history: The events.
        replacements: Objects to put in place of dotted names during the run: defects that the rules
            have to find.
    """
    memory = Path("/dev/shm")
    folder = Path(tempfile.mkdtemp(prefix="soak-", dir=memory if memory.is_dir() else None))
    try:
        with ExitStack() as stack:
            for name, replacement in (replacements or {}).items():
                stack.enter_context(mock.patch(name, replacement))
            before = _held()
            story = VirtualCell(history, folder).run()
            grown = [f"{name}: {was} before, {now}" for name, was, now in _grown(before)]
            story.checks["NothingGrows"] += 1
            if grown:
                story.break_rule("NothingGrows", ", ".join(grown))
            return story
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _held() -> dict[str, int]:
    """Return the number of threads and open files of this process, where they can be counted."""
    held = {"threads": threading.active_count()}
    with suppress(OSError):
        held["open files"] = len(os.listdir("/proc/self/fd"))
    return held


def _grown(before: Mapping[str, int]) -> Iterator[tuple[str, int, int]]:
    """Yield the counts that have grown."""
    if all(now <= before[name] for name, now in _held().items()):
        return
    gc.collect()  # a dropped connection is closed when it is collected
    for name, now in _held().items():
        if now > before[name]:
            yield name, before[name], now


MOST_RUNS: Final = 200
"""The number of histories after which shortening ends."""

Run = Callable[[History], Story]


def shrink(history: History, rule: str, *, run: Run = live_through) -> History:
    """Return a shorter history that still breaks a rule.

    Hours are left out first, then disturbances; each draws its own chance, so the rest stays the
    same. A history that does not break the rule is returned unchanged.

    Args:
        history: The history found.
        rule: Name of the rule that it breaks.
        run: Runs a history, with the same replacements as when it was found.
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
    """Yield shortened histories, the shortest first."""
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
    """Return a Python test file that runs a history and requires every rule."""
    hours = "".join(_hour(hour) for hour in history.hours)
    return f'''"""Found by the adversary under seed {history.seed}: {rule} did not hold."""

from tests.soak.adversary import live_through
from tests.soak.adversary.history import (
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
