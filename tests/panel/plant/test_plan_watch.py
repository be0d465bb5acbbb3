"""The plant's database is asked while a page of plans is open, and not after."""

import asyncio
from typing import Any

import pytest
from robolink_cli.panel.plant import plan_watch
from robolink_cli.panel.plant.plan_watch import LOOK_S, PlanWatch


class Desk:
    """Notes how often the database is asked."""

    def __init__(self):
        self.asked = 0

    async def ask(self, _look):
        self.asked += 1
        return plan_watch.PlantSight(opened={"4711": None}, heard_at="now")


class Clock:
    """A monotonic time that a test moves."""

    now_s = 100.0

    def monotonic(self):
        return self.now_s


@pytest.fixture
def passed(monkeypatch):
    """Make the watch go round without a pause; return what waits until it went round once more."""
    clock = Clock()
    rounds: list[None] = []

    async def round_ended(_pause_s):
        rounds.append(None)
        await resting(0)

    async def passed(seconds):
        clock.now_s += seconds
        until = len(rounds) + 2
        while len(rounds) < until:
            await resting(0)

    resting = asyncio.sleep
    monkeypatch.setattr(plan_watch, "time", clock)
    monkeypatch.setattr(plan_watch, "_is_present", lambda: True)
    monkeypatch.setattr(asyncio, "sleep", round_ended)
    return passed


@pytest.mark.parametrize("plan", ["", "4711"])
def test_only_what_a_page_shows_is_asked_for_and_that_now_and_then(plan, passed):
    async def watched():
        desk: Any = Desk()
        watch = PlanWatch(desk, lambda: None)
        task = asyncio.create_task(watch.run())
        asked = []
        await passed(0)
        asked.append(desk.asked)  # no page is open
        watch.want(plan)
        for seconds in (0, LOOK_S / 2, LOOK_S, LOOK_S, 600, 600):
            await passed(seconds)
            asked.append(desk.asked)
        task.cancel()
        return asked

    #                                 opened  soon  still open  closed since 5 s
    assert asyncio.run(watched()) == [0, 1, 1, 2, 2, 2, 2]
