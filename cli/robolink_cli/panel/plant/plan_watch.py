"""How the plans stand, as the plant's database said last: one look for all pages, now and then.

Nobody waits for a look. A page shows what was heard last and when, or since when nothing was.
"""

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.config import named_plant
from robolink.errors import RobolinkError
from robolink.fleet import LineJobStore, PlanError, PlanOverview, PlanProgress, default_plant
from robolink.timing import wall_label
from robolink_cli.panel.plant.desk import PlantDesk

LOOK_S: Final = 2.0
"""Pause in s between two looks while a page of plans is open."""

_WANTED_S: Final = 5.0
"""For so long in s after a page has asked, it counts as open."""

_SOON_S: Final = 0.25
_FIRST_S: Final = 1.0
"""Longest wait in s of a page for its first look."""

_MOST_PLANS: Final = 50
_MOST_OPENED: Final = 8
"""Plans whose cells are read at one look: those that were opened last."""


@dataclass(frozen=True, slots=True)
class PlantSight:
    """What was heard of the plans.

    Attributes:
        plans: The newest, in a line each.
        opened: Of those that pages show, all their cells; by id.
        heard_at: When, as a label; empty where nothing was heard yet.
        failed: Why the last look did not succeed; empty where it did.
        failed_at: Since when none did, as a label.
    """

    plans: tuple[PlanOverview, ...] = ()
    opened: Mapping[str, PlanProgress | None] = field(default_factory=dict, hash=False)
    heard_at: str = ""
    failed: str = ""
    failed_at: str = ""


class PlanWatch:
    """Looks at the plans while somebody has a page of them open.

    Args:
        desk: Asks the plant's database.
        changed: Called when there is something new to show.

    Attributes:
        sight: What was heard last.
        present: Whether there is anything to look at, as far as was known at the last look.
    """

    def __init__(self, desk: PlantDesk, changed: Callable[[], None]) -> None:
        self._desk, self._changed = desk, changed
        self.sight = PlantSight()
        self.present = False
        self._wanted: dict[str, float] = {}
        self._news = asyncio.Event()

    def want(self, plan: str = "") -> PlantSight:
        """Return what was heard last, and have it looked at meanwhile.

        Args:
            plan: A plan whose cells are shown; empty for the list.
        """
        self._wanted.pop(plan, None)
        self._wanted[plan] = time.monotonic()
        while len(self._wanted) > _MOST_OPENED:
            del self._wanted[next(iter(self._wanted))]
        return self.sight

    async def first(self, plan: str = "") -> PlantSight:
        """Return the same, after a short wait where nothing was heard of that plan yet.

        Args:
            plan: As of :meth:`want`.
        """
        until_s = time.monotonic() + _FIRST_S
        while True:
            sight = self.want(plan)
            known = plan in sight.opened if plan else sight.heard_at
            left_s = until_s - time.monotonic()
            if known or sight.failed or left_s <= 0:
                return sight
            self._news.clear()
            try:
                await asyncio.wait_for(self._news.wait(), left_s)
            except TimeoutError:
                return self.sight

    def look_again(self) -> None:
        """Forget what was heard: something was changed just now."""
        self._looked_s = -LOOK_S

    async def run(self) -> None:
        """Look, until cancelled."""
        self._looked_s = -LOOK_S
        present_s = -_WANTED_S
        while True:
            now_s = time.monotonic()
            if now_s - present_s >= _WANTED_S:
                self.present, present_s = await asyncio.to_thread(_is_present), now_s
            wanted = [plan for plan, at_s in self._wanted.items() if now_s - at_s < _WANTED_S]
            if wanted and self._is_due(now_s, wanted):
                self._looked_s = now_s
                await self._look([plan for plan in wanted if plan])
                # A database that is slow is asked less.
                self._looked_s = max(now_s, 2 * time.monotonic() - now_s - LOOK_S)
            await asyncio.sleep(_SOON_S)

    def _is_due(self, now_s: float, wanted: list[str]) -> bool:
        new = any(plan and plan not in self.sight.opened for plan in wanted)
        return now_s - self._looked_s >= LOOK_S or (new and not self.sight.failed)

    async def _look(self, plans: list[str]) -> None:
        def looked(store: LineJobStore, _confirm: Callable[[], None]) -> PlantSight:
            if not store.made:
                return PlantSight(heard_at=wall_label())
            opened = {plan: _progress(store, plan) for plan in plans}
            return PlantSight(store.overviews(_MOST_PLANS), opened, wall_label())

        before = self.sight
        try:
            self.sight = await self._desk.ask(looked)
        except RobolinkError as error:
            since = before.failed_at or wall_label()
            self.sight = PlantSight(before.plans, before.opened, before.heard_at, error.what, since)
        self._news.set()
        if self.sight != before:
            self._changed()


def _progress(store: LineJobStore, plan: str) -> PlanProgress | None:
    try:
        return store.progress(plan)
    except PlanError:  # there is none of that id
        return None


def _is_present() -> bool:
    """Return whether a plant is named, or plans were kept on this computer."""
    return named_plant() is not None or Path(default_plant()).exists()
