"""The cells of a panel, and the tablets that look at them.

A cell has one snapshot: the last view of its job, or how it was seen last. Each tablet is sent what
differs from what it was sent before; one that is slow loses what was in between, and never holds
up another. Nothing here reaches a controller.
"""

import asyncio
import secrets
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Any, Final, Protocol

from robolink.errors import RobolinkError
from robolink.locale.languages import ENGLISH
from robolink.messages import tr
from robolink.transport import far_end_of
from robolink_cli.console.output import show
from robolink_cli.panel.board import OVERVIEW_S, Board, PanelCell
from robolink_cli.panel.camera import READ_S, newest_of
from robolink_cli.panel.cards import A_PAGE, ALL_CELLS, SIGNS, CellChoice, CellsBar, GroupCard
from robolink_cli.panel.jobs import JobKind, PanelJob
from robolink_cli.panel.pages import Pages, Parts, Watcher
from robolink_cli.panel.recipes import recipes_of
from robolink_cli.panel.record import standing_of
from robolink_cli.panel.watch import AT_ONCE
from robolink_cli.panel.words import speaking_in
from robolink_cli.session.cell_plans import PlannedJob, due_at_cells
from robolink_cli.session.plant_outbox import PLANT_S, copy_journals_in_use

BEAT_S: Final = 0.25
"""Longest time in s without a frame to a tablet."""

HEARD_S: Final = 1.0
"""A tablet counts as heard for so long in s after its last frame."""

GONE_S: Final = 10.0
"""After so long in s without a frame its connection is closed; it makes another when it can."""

ALIVE_S: Final = 0.5
"""Interval in s at which a job is told that its seat's tablet is heard."""

RECORD_S: Final = 10.0
"""Interval in s at which the record of a cell is read anew while a page shows it."""

MANY_CELLS: Final = 200
"""So many records can be read within that time, with time left for all else."""

READS_AT_ONCE: Final = 2
"""Records that are read at the same time, where nobody waits for one."""

AGAIN_S: Final = 0.25
"""Shortest time in s between two drawings of the page of many cells."""


class SeatHolder(Protocol):
    """Who commands a cell."""

    @property
    def tablet(self) -> str:
        """Id of the tablet."""

    @property
    def who(self) -> str:
        """The person; empty for the panel's own PIN."""

    @property
    def address(self) -> str:
        """Where the tablet is."""


class SeatTable(Protocol):
    """Who commands which cell."""

    def holder(self, cell: str, *, moving: bool | None = None) -> SeatHolder | None:
        """Return who commands a cell, ``None`` for nobody."""


Send = Callable[[Mapping[str, object]], Awaitable[None]]
"""Sends a frame to a tablet."""


@dataclass(eq=False)
class LivePage:
    """A page of a tablet, over its WebSocket.

    Attributes:
        send: Sends a frame; it waits while the tablet is slow.
        watcher: Who looks, as it is now.
        tablet: Id of the tablet.
        cell: The cell that the page shows; empty for any other page.
        draw: Draws a page that is about no cell; ``None`` for the overview, and that of a cell.
        choice: Which cells the overview shows.
        heard_s: When the last frame came from it, monotonic.
    """

    send: Send
    watcher: Callable[[], Watcher]
    tablet: str
    cell: str = ""
    draw: Callable[[Watcher, float], Parts] | None = None
    choice: CellChoice = ALL_CELLS
    heard_s: float = field(default_factory=time.monotonic)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    shown: dict[str, str] = field(default_factory=dict)
    screen: tuple[str, int] = ("", -1)

    def follows(self, cell: str) -> bool:
        """Return whether something new of a cell may show on it."""
        return self.cell == cell or (not self.cell and self.draw is None)


class Hub:
    """The cells, and the pages that are open.

    Args:
        cells: What is shown.
        pages: Draws it.
        seats: Who works on which.
        note: Puts something on record: kind, cell, facts.
        groups: The words of each group of the cell files.
        plant: Id of the plant whose plans people carry out here.

    Attributes:
        has_plans: Whether there is a page of plans.
    """

    def __init__(
        self,
        cells: Iterable[PanelCell],
        pages: Pages,
        seats: SeatTable,
        note: Callable[..., None],
        groups: Mapping[str, Sequence[str]] | None = None,
        *,
        plant: str = "plant",
    ) -> None:
        slots = asyncio.Semaphore(AT_ONCE)
        self.boards = {cell.name: Board(cell, self._changed, slots) for cell in cells}
        self.pages = pages
        self._seats = seats
        self._note, self._plant = note, plant
        self.server = secrets.token_hex(8)
        self.lives: set[LivePage] = set()
        self._tasks: set[asyncio.Task[Any]] = set()
        self._drawn: dict[tuple[Watcher, CellChoice], Parts] = {}
        self._drawn_s, self._is_old = 0.0, False
        self._groups = {
            group: tuple(name for name in self.boards if _is_in(name, words, self.boards))
            for group, words in (groups or {}).items()
        }
        self._reads = asyncio.Semaphore(READS_AT_ONCE)
        self.has_plans = False

    # What happens of itself.

    async def run(self) -> None:
        """Look at cells, and tell jobs whether their tablet is heard, until cancelled."""
        for board in self.boards.values():
            self.spawn(self._read_in_turn(board))
        beside = [
            asyncio.ensure_future(work) for work in (self._copy_to_the_plant(), self._read_plans())
        ]
        try:
            while True:
                now_s = time.monotonic()
                for board in self.boards.values():
                    self._tend(board, now_s)
                await asyncio.sleep(ALIVE_S)
        finally:
            for task in beside:
                task.cancel()

    async def _copy_to_the_plant(self) -> None:
        while True:
            await asyncio.to_thread(copy_journals_in_use)
            await asyncio.sleep(PLANT_S)

    async def _read_plans(self) -> None:
        """Read which plan waits for a person at which cell, while a page is open."""
        while True:
            if self.lives:
                with suppress(RobolinkError, OSError):  # the job itself says what is wrong
                    self._offer(await asyncio.to_thread(due_at_cells, self._plant))
            await asyncio.sleep(RECORD_S if self.lives else ALIVE_S)

    def _offer(self, planned: Mapping[str, PlannedJob]) -> None:
        for board in self.boards.values():
            cell = board.cell.configured
            at_home = cell is None or cell.home.refusal() is None
            if board.planned != (now := planned.get(board.name) if at_home else None):
                board.planned = now
                board.renew()

    def _tend(self, board: Board, now_s: float) -> None:
        job = board.job
        shown = any(live.follows(board.name) for live in self.lives)
        if board.cameras and now_s - board.camera_s >= READ_S and self._is_open(board):
            board.camera_s = now_s
            self.spawn(self._read_camera(board))
        if shown and now_s - board.record_s >= self._record_s:
            board.record_s = now_s
            self.spawn(self._read_in_turn(board))
        if job is None:
            if board.watch.is_due(now_s, wanted=board.opened):
                board.opened = False
                self.spawn(self._look(board))
            return
        if self.is_heard(board.name, now_s):
            job.alive()

    def is_heard(self, cell: str, now_s: float) -> bool:
        """Return whether a tablet that has the seat of a cell is heard on the cell's page."""
        holder = self._seats.holder(cell)
        return holder is not None and any(
            live.cell == cell and live.tablet == holder.tablet and now_s - live.heard_s < HEARD_S
            for live in self.lives
        )

    async def _look(self, board: Board) -> None:
        await board.watch.take(self._language_at(board.name))
        await self.read_standing(board)

    def _language_at(self, cell: str) -> str:
        """Return the language of who looks at a cell, else of who looks at all."""
        pages = sorted(self.lives, key=lambda live: live.cell == cell, reverse=True)
        return next((live.watcher().language for live in pages if live.follows(cell)), ENGLISH)

    @property
    def _record_s(self) -> float:
        """Interval in s at which a record is read anew: longer, the more there are."""
        return RECORD_S * max(1.0, len(self.boards) / MANY_CELLS)

    async def _read_in_turn(self, board: Board) -> None:
        """Read a record that nobody waits for; few at the same time."""
        async with self._reads:
            await self.read_standing(board)

    async def read_standing(self, board: Board) -> None:
        """Read what is on record of a cell."""
        board.record_s = time.monotonic()
        cell, before = board.cell, (board.standing, board.recipes)
        board.standing = await asyncio.to_thread(standing_of, cell.url, board.standing)
        board.recipes = await asyncio.to_thread(recipes_of, cell.configured)
        if before != (board.standing, board.recipes):
            board.renew()

    def _is_open(self, board: Board) -> bool:
        return any(live.cell == board.name for live in self.lives)

    async def _read_camera(self, board: Board) -> None:
        """Read the newest picture of the cell's cameras, and show it where it is another."""
        before = board.camera
        board.camera = await asyncio.to_thread(newest_of, board.cameras, before)
        if board.camera is not before:
            board.renew()

    def spawn(self, work: Any) -> None:  # noqa: ANN401 - any coroutine
        """Do something beside, and keep hold of it until it has ended."""
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # Jobs.

    async def begin(
        self,
        board: Board,
        kind: JobKind,
        *,
        language: str,
        who: str,
        values: Mapping[str, str],
        station: tuple[str, int] | None = None,
        subject: str = "",
    ) -> None:
        """Begin a job on a cell that has none.

        Raises:
            OSError: It cannot be started.
        """
        if kind.of_plan:
            values = {**values, "--plant": self._plant}
        job = PanelJob(
            board.name,
            kind,
            language=language,
            who=who,
            changed=board.renew,
            values=values,
            station=station,
            subject=subject,
        )
        board.next_numbers()
        board.job, board.said = job, ()
        try:
            await job.start()
        except BaseException:
            board.job = None
            raise
        board.renew()
        self.spawn(self._until_end(board, job))

    async def _until_end(self, board: Board, job: PanelJob) -> None:
        await job.wait()
        end = job.end
        if board.job is job:
            board.next_numbers()
            board.job = None
        board.watch.look = None  # how it was before the job says nothing
        board.opened = any(live.cell == board.name for live in self.lives)
        if end is not None:
            board.said = end.kept if end.in_order else _lost(job.language)
            if not end.in_order:
                self._note("job_lost", board.name, job=job.kind.name)
                show(end.errors, beside=True)  # for whoever runs the panel
        await self.read_standing(board)

    # Pages.

    def _changed(self, board: Board) -> None:
        self._is_old = True
        for live in self.lives:
            if live.follows(board.name):
                live.news.set()

    def plans_changed(self) -> None:
        """Draw the pages of plans anew: something was heard of them."""
        for live in self.lives:
            if live.draw is not None:
                live.news.set()

    def everything_changed(self, tablet: str = "") -> None:
        """Draw pages anew: seat, person or language are others.

        Args:
            tablet: Whose pages; empty for all.
        """
        self._drawn.clear()
        for live in self.lives:
            if tablet in ("", live.tablet):
                live.news.set()

    async def show(self, live: LivePage) -> None:
        """Send a page what it shows, until it is gone."""
        self.lives.add(live)
        board = self.boards.get(live.cell)
        if board is not None:
            board.opened = True
        beat_s = 0.0
        try:
            while True:
                live.news.clear()
                now_s = time.monotonic()
                if now_s - live.heard_s > GONE_S:
                    return
                frame = self.frame(live, now_s)
                if frame is not None:
                    await asyncio.wait_for(live.send(frame), GONE_S)
                if now_s - beat_s >= BEAT_S - 0.01:
                    beat_s = now_s
                    await asyncio.wait_for(live.send(self.beat(live, now_s)), GONE_S)
                with suppress(TimeoutError):
                    left_s = max(0.0, beat_s + BEAT_S - time.monotonic())
                    await asyncio.wait_for(live.news.wait(), left_s)
        finally:
            self.lives.discard(live)

    def frame(self, live: LivePage, now_s: float) -> dict[str, object] | None:
        """Return what differs from what a page was sent before; ``None`` for nothing."""
        watcher = live.watcher()
        board = self.boards.get(live.cell)
        if board is not None:
            parts, number = board.parts(self.pages, watcher, now_s), board.number
        elif live.draw is not None:
            parts, number = live.draw(watcher, now_s), 0
        else:
            parts, number = self.overview(watcher, now_s, live.choice), 0
        named = parts.named()
        changed = {name: text for name, text in named.items() if live.shown.get(name) != text}
        if not changed and live.screen == (parts.screen, number):
            return None
        live.shown, live.screen = named, (parts.screen, number)
        return {"t": "screen", "screen": parts.screen, "number": number, "parts": changed}

    def overview(self, watcher: Watcher, now_s: float, choice: CellChoice = ALL_CELLS) -> Parts:
        """Return the parts that show all cells.

        Args:
            watcher: Who looks.
            now_s: The time, monotonic.
            choice: Which cells.
        """
        least_s = AGAIN_S if self._is_old and len(self.boards) > MANY_CELLS else OVERVIEW_S
        if now_s - self._drawn_s > least_s or (self._is_old and len(self.boards) <= MANY_CELLS):
            self._drawn.clear()
            self._drawn_s, self._is_old = now_s, False
        found = self._drawn.get((watcher, choice))
        if found is None:
            found = self._drawn[watcher, choice] = self._overview(watcher, now_s, choice)
        return found

    def _overview(self, watcher: Watcher, now_s: float, choice: CellChoice) -> Parts:
        with speaking_in(watcher.language):
            names = self._groups.get(choice.group, ()) if choice.group else tuple(self.boards)
            signs = {name: self.boards[name].sign(now_s) for name in names}
            found = [name for name in names if choice.sign in ("", signs[name])]
            pages = max(1, -(-len(found) // A_PAGE))
            choice = replace(choice, page=min(max(choice.page, 1), pages))
            first = (choice.page - 1) * A_PAGE
            shown = [] if choice.groups else found[first : first + A_PAGE]
            bar = CellsBar(
                choice,
                len(names),
                _counted(signs.values()),
                len(found),
                1 if choice.groups else pages,
                self._group_cards(signs) if choice.groups else (),
                bool(self._groups),
                self.has_plans,
            )
            cards = [self.boards[name].card(watcher, now_s, seat=self._who(name)) for name in shown]
            return self.pages.overview(cards, watcher, bar)

    def _group_cards(self, signs: Mapping[str, str]) -> tuple[GroupCard, ...]:
        return tuple(
            GroupCard(group, len(names), _counted(signs[name] for name in names))
            for group, names in self._groups.items()
        )

    def _who(self, cell: str) -> str:
        holder = self._seats.holder(cell)
        if holder is None:
            return ""
        return holder.who or tr("the tablet at {address}", address=holder.address)

    def beat(self, live: LivePage, now_s: float) -> dict[str, object]:
        """Return the frame that shows that this server is alive."""
        board = self.boards.get(live.cell)
        age_ms, status = board.status(now_s) if board is not None else (None, {})
        camera = board.camera if board is not None else None
        look_ms = None if camera is None else round(camera.age_s() * 1000)
        return {"t": "beat", "age_ms": age_ms, "look_ms": look_ms, "status": status}


def _counted(signs: Iterable[str]) -> dict[str, int]:
    """Return how many cells have each sign that one has, the most urgent first."""
    counts = Counter(signs)
    return {sign: counts[sign] for sign in SIGNS if counts[sign]}


def _is_in(name: str, words: Sequence[str], names: Iterable[str]) -> bool:
    """Return whether the words of a group name a cell; ``names`` are those of all cells."""
    return any(word == name or (word not in names and fnmatchcase(name, word)) for word in words)


def keys_of(cell: PanelCell) -> frozenset[str]:
    """Return the far end of a cell; nothing where its URL is none."""
    try:
        return far_end_of(cell.url)
    except RobolinkError:
        return frozenset()


def _lost(language: str) -> tuple[str, ...]:
    with speaking_in(language):
        return (tr("The job's process ended without saying how. What it began is on record."),)
