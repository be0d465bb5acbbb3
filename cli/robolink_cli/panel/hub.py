"""The cells of a panel, and the tablets that look at them.

A cell has one snapshot: the last view of its job, or how it was seen last. Each tablet is sent what
differs from what it was sent before; one that is slow loses what was in between, and never holds
up another. Nothing here reaches a controller.
"""

import asyncio
import secrets
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final, Protocol

from robolink.errors import RobolinkError
from robolink.messages import spoken, tr
from robolink.transport import far_end_of
from robolink_cli.console.output import show
from robolink_cli.panel.cards import CellCard, JobOffer
from robolink_cli.panel.jobs import KINDS, JobKind, PanelJob
from robolink_cli.panel.pages import Pages, Parts, Watcher
from robolink_cli.panel.watch import AT_ONCE, CellWatch, Standing, card_of, standing_of
from robolink_cli.panel.words import speaking_in
from robolink_cli.wizard.views.records import MovingView, View

BEAT_S: Final = 0.25
"""Longest time in s without a frame to a tablet."""

HEARD_S: Final = 1.0
"""A tablet counts as heard for so long in s after its last frame."""

GONE_S: Final = 10.0
"""After so long in s without a frame its connection is closed; it makes another when it can."""

ALIVE_S: Final = 0.5
"""Interval in s at which a job is told that its seat's tablet is heard."""

OVERVIEW_S: Final = 1.0
"""Interval in s at which the overview is drawn anew while nothing happens."""

_NUMBERS: Final = 1_000_000
"""Questions of one job; numbers of another job begin behind them."""


class SeatHolder(Protocol):
    """Who commands a cell."""

    @property
    def tablet(self) -> str:
        """Id of the tablet."""

    @property
    def who(self) -> str:
        """The person; empty for the panel's own PIN."""


class SeatTable(Protocol):
    """Who commands which cell."""

    def holder(self, cell: str, *, moving: bool | None = None) -> SeatHolder | None:
        """Return who commands a cell, ``None`` for nobody."""


@dataclass(frozen=True, slots=True)
class PanelCell:
    """A cell that the panel shows.

    Attributes:
        name: Its name.
        url: Its controller.
        watch_s: How often it is looked at; ``None`` for only when a page is opened.
        simulated: Whether nothing real moves, as far as its URL says.
        stations: Names of its stations.
        tool: The tool that works there, with which stations are found; ``None`` where the cell
            file says none.
    """

    name: str
    url: str
    watch_s: float | None = None
    simulated: bool = False
    stations: tuple[str, ...] = ()
    tool: int | None = None


class Board:
    """One cell: its job, or how it was seen last.

    Args:
        cell: The cell.
        changed: Called with it when there is something new to show.
        slots: Taken for a look, of all cells together.
    """

    def __init__(
        self, cell: PanelCell, changed: "Callable[[Board], None]", slots: asyncio.Semaphore
    ) -> None:
        self.cell = cell
        self._changed = changed
        self.watch = CellWatch(cell.name, cell.url, cell.watch_s, self.renew, slots)
        self.standing = Standing()
        self.job: PanelJob | None = None
        self.said: tuple[str, ...] = ()
        self.base = (1 + secrets.randbelow(1000)) * _NUMBERS
        self.opened = False
        self._drawn: dict[Watcher, Parts] = {}
        self._drawn_s = 0.0

    @property
    def name(self) -> str:
        """The cell's name."""
        return self.cell.name

    @property
    def view(self) -> View | None:
        """What the job shows; ``None`` where no job runs, or it has shown nothing yet."""
        return self.job.view if self.job is not None else None

    @property
    def moving(self) -> bool:
        """Whether a job moves the robot by itself."""
        view = self.view
        return view is not None and isinstance(view.body, MovingView)

    @property
    def number(self) -> int:
        """The number of the question that is on the screen; no two jobs share one."""
        return self.base + (self.view.number if self.view is not None else 0)

    def renew(self) -> None:
        """Forget what was drawn, and tell the tablets."""
        self._drawn.clear()
        self._changed(self)

    def next_numbers(self) -> None:
        """Give what is shown from now on numbers of its own."""
        self.base += _NUMBERS

    def question(self) -> int:
        """Return the number that the job itself gives its question."""
        return self.number - self.base

    def parts(self, pages: Pages, watcher: Watcher, now_s: float) -> Parts:
        """Return the parts of the cell's page."""
        if self.job is None and now_s - self._drawn_s > OVERVIEW_S:
            self._drawn.clear()  # what is said of an idle cell ages
        if not self._drawn:
            self._drawn_s = now_s
        found = self._drawn.get(watcher)
        if found is None:
            view = self.view
            found = (
                pages.screen(view, watcher)
                if view is not None
                else pages.idle(self.card(watcher, now_s), watcher)
            )
            self._drawn[watcher] = found
        return found

    def status(self, now_s: float) -> tuple[int, dict[str, object]]:
        """Return the age of the last reading in ms, and what it was."""
        view, job = self.view, self.job
        if view is not None and view.status is not None and job is not None:
            status = asdict(view.status)
            age_s = status.pop("age_s") + (now_s - job.view_s)
            return round(age_s * 1000), status
        look = self.watch.look
        if job is None and look is not None and not look.failed:
            return round((now_s - look.taken_s) * 1000), {"state": look.state}
        return 0, {}

    def card(self, watcher: Watcher, now_s: float, *, seat: str = "") -> CellCard:
        """Return what the overview shows of it."""
        with speaking_in(watcher.language):
            if self.job is not None:
                return self._busy(watcher, self.job, seat)
            simulated, said = self.cell.simulated, self.said
            card = card_of(self.watch, self.standing, now_s, simulated=simulated, said=said)
            return replace(card, seat=seat, jobs=self.offers(watcher))

    def offers(self, watcher: Watcher) -> tuple[JobOffer, ...]:
        """Return the jobs that can be begun, in the language that is spoken."""
        found = list[JobOffer]()
        for kind in filter(self._is_of_use, KINDS.values()):
            why_not = self._why_not(kind, watcher)
            if kind.of_station:
                found += [
                    JobOffer(
                        kind.name,
                        tr("Find the station {station} again", station=station),
                        values={"station": station},
                        why_not=why_not,
                    )
                    for station in self.cell.stations
                ]
            else:
                found.append(JobOffer(kind.name, spoken(kind.title), why_not=why_not))
        return tuple(found)

    def station(self, kind: JobKind, given: object) -> tuple[str, int] | None:
        """Return the station of a job and the tool that finds it; ``None`` where it has none.

        Args:
            kind: The job.
            given: ``values`` of the press.
        """
        named = given.get("station") if isinstance(given, Mapping) else None
        if not kind.of_station or self.cell.tool is None or named not in self.cell.stations:
            return None
        return str(named), self.cell.tool

    def _is_of_use(self, kind: JobKind) -> bool:
        if kind.name == "recover":
            return bool(self.standing.interrupted)
        if kind.of_station:
            return self.cell.tool is not None
        return kind.name != "release" or self.standing.stopped is not None

    def _why_not(self, kind: JobKind, watcher: Watcher) -> str:
        if self.standing.interrupted and kind.name not in ("recover", "release"):
            return tr("First finish or undo the interrupted job.")
        if watcher.role and not may_begin(kind, watcher.role):
            return tr("This takes an engineer.")
        return ""

    def _busy(self, watcher: Watcher, job: PanelJob, seat: str) -> CellCard:
        view = job.view
        title = spoken(job.kind.title)
        lines = [title] if view is None else [f"{title}: {view.head.title}"]
        halted = view is not None and view.status is not None and view.status.halted
        mark, word = "look", tr("job running")
        if halted and view is not None and view.status is not None:
            mark, word = "bad", view.status.state
        elif self.moving:
            word = tr("moving")
        simulated = self.cell.simulated or (view is not None and view.head.simulated)
        card = CellCard(self.name, mark, word, tuple(lines), simulated=simulated, busy=True)
        return replace(card, seat=seat or watcher.seat)


def may_begin(kind: JobKind, role: str) -> bool:
    """Return whether somebody with a role may begin a job."""
    return role == "engineer" or role == kind.role


Send = Callable[[Mapping[str, object]], Awaitable[None]]
"""Sends a frame to a tablet."""


@dataclass(eq=False)
class LivePage:
    """A page of a tablet, over its WebSocket.

    Attributes:
        send: Sends a frame; it waits while the tablet is slow.
        watcher: Who looks, as it is now.
        tablet: Id of the tablet.
        cell: The cell that the page shows; empty for the overview.
        heard_s: When the last frame came from it, monotonic.
    """

    send: Send
    watcher: Callable[[], Watcher]
    tablet: str
    cell: str = ""
    heard_s: float = field(default_factory=time.monotonic)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    shown: dict[str, str] = field(default_factory=dict)
    screen: tuple[str, int] = ("", -1)


class Hub:
    """The cells, and the pages that are open.

    Args:
        cells: What is shown.
        pages: Draws it.
        seats: Who works on which.
        note: Puts something on record: kind, cell, facts.
    """

    def __init__(
        self,
        cells: Iterable[PanelCell],
        pages: Pages,
        seats: SeatTable,
        note: Callable[..., None],
    ) -> None:
        slots = asyncio.Semaphore(AT_ONCE)
        self.boards = {cell.name: Board(cell, self._changed, slots) for cell in cells}
        self.pages = pages
        self._seats = seats
        self._note = note
        self.server = secrets.token_hex(8)
        self.lives: set[LivePage] = set()
        self._tasks: set[asyncio.Task[Any]] = set()
        self._drawn: dict[Watcher, Parts] = {}
        self._drawn_s = 0.0

    # What happens of itself.

    async def run(self) -> None:
        """Look at cells, and tell jobs whether their tablet is heard, until cancelled."""
        for board in self.boards.values():
            self.spawn(self.read_standing(board))
        while True:
            now_s = time.monotonic()
            for board in self.boards.values():
                self._tend(board, now_s)
            await asyncio.sleep(ALIVE_S)

    def _tend(self, board: Board, now_s: float) -> None:
        job = board.job
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
        await board.watch.take()
        await self.read_standing(board)

    async def read_standing(self, board: Board) -> None:
        """Read what is on record of a cell."""
        board.standing = await asyncio.to_thread(standing_of, board.cell.url)
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
    ) -> None:
        """Begin a job on a cell that has none.

        Raises:
            OSError: It cannot be started.
        """
        job = PanelJob(
            board.name,
            kind,
            language=language,
            who=who,
            changed=board.renew,
            values=values,
            station=station,
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
        self._drawn.clear()
        for live in self.lives:
            if live.cell in ("", board.name):
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
        else:
            parts, number = self.overview(watcher, now_s), 0
        named = parts.named()
        changed = {name: text for name, text in named.items() if live.shown.get(name) != text}
        if not changed and live.screen == (parts.screen, number):
            return None
        live.shown, live.screen = named, (parts.screen, number)
        return {"t": "screen", "screen": parts.screen, "number": number, "parts": changed}

    def overview(self, watcher: Watcher, now_s: float) -> Parts:
        """Return the parts that show all cells."""
        if now_s - self._drawn_s > OVERVIEW_S:
            self._drawn.clear()
            self._drawn_s = now_s
        found = self._drawn.get(watcher)
        if found is None:
            found = self._drawn[watcher] = self.pages.overview(self.cards(watcher, now_s), watcher)
        return found

    def cards(self, watcher: Watcher, now_s: float) -> list[CellCard]:
        """Return what the overview shows of each cell."""
        return [
            board.card(watcher, now_s, seat=self._who(board.name)) for board in self.boards.values()
        ]

    def _who(self, cell: str) -> str:
        holder = self._seats.holder(cell)
        return "" if holder is None else holder.who

    def beat(self, live: LivePage, now_s: float) -> dict[str, object]:
        """Return the frame that shows that this server is alive."""
        board = self.boards.get(live.cell)
        age_ms, status = board.status(now_s) if board is not None else (0, {})
        return {"t": "beat", "age_ms": age_ms, "status": status}


def keys_of(cell: PanelCell) -> frozenset[str]:
    """Return the far end of a cell; nothing where its URL is none."""
    try:
        return far_end_of(cell.url)
    except RobolinkError:
        return frozenset()


def _lost(language: str) -> tuple[str, ...]:
    with speaking_in(language):
        return (tr("The job's process ended without saying how. What it began is on record."),)
