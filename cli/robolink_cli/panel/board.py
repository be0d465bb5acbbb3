"""One cell on the pages: its job, or how it was seen last, and what can be begun on it.

Nothing here reaches a controller.
"""

import asyncio
import secrets
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Final

from robolink.messages import spoken, tr
from robolink_cli.panel.camera import CameraLook, cameras_of
from robolink_cli.panel.cards import CellCard, JobOffer
from robolink_cli.panel.jobs import KINDS, JobKind, PanelJob
from robolink_cli.panel.pages import Pages, Parts, Watcher
from robolink_cli.panel.recipes import RecipeOffer
from robolink_cli.panel.record import Standing
from robolink_cli.panel.watch import CellWatch, card_of, mark_of
from robolink_cli.panel.words import speaking_in
from robolink_cli.session.cell_plans import PlannedJob
from robolink_cli.wizard.views.records import MovingView, TouchView, View

if TYPE_CHECKING:
    from robolink.config import Cell

OVERVIEW_S: Final = 1.0
"""Interval in s at which what is said of an idle cell is drawn anew while nothing happens."""

_NUMBERS: Final = 1_000_000
"""Questions of one job; numbers of another job begin behind them."""


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
        configured: All that the cell file says of it; ``None`` where there is none.
    """

    name: str
    url: str
    watch_s: float | None = None
    simulated: bool = False
    stations: tuple[str, ...] = ()
    tool: int | None = None
    configured: "Cell | None" = field(default=None, compare=False)


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
        self.recipes: tuple[RecipeOffer, ...] = ()
        self.planned: PlannedJob | None = None
        self.record_s = 0.0
        self._simulated: bool | None = None
        self.job: PanelJob | None = None
        self.said: tuple[str, ...] = ()
        self.base = (1 + secrets.randbelow(1000)) * _NUMBERS
        self.opened = False
        self.cameras = cameras_of(cell.configured)
        self.camera: CameraLook | None = None
        self.camera_s = 0.0
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
        """Whether the robot moves: by itself, by a step of a jog, or as long as a key is held."""
        view, job = self.view, self.job
        if view is None or job is None:
            return False
        jogs = isinstance(view.body, TouchView) and (not view.waits or job.is_held)
        return jogs or isinstance(view.body, MovingView)

    @property
    def simulated(self) -> bool:
        """Whether nothing real moves: what who read the controller last says, else the record."""
        view, look = self.view, self.watch.look
        if view is not None:
            if view.status is not None or view.head.simulated:
                self._simulated = view.head.simulated
        elif look is not None and look.failed:
            self._simulated = None
            return self.cell.simulated  # what does not answer may be another by now
        elif look is not None and look.simulated is not None:
            self._simulated = look.simulated
        known = self.standing.simulated if self._simulated is None else self._simulated
        return self.cell.simulated or known

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
                pages.screen(view, watcher, camera=self.camera)
                if view is not None
                else pages.idle(self.card(watcher, now_s), watcher, camera=self.camera)
            )
            self._drawn[watcher] = found
        return found

    def status(self, now_s: float) -> tuple[int | None, dict[str, object]]:
        """Return the age of the last reading in ms, and what it was; ``None`` without one."""
        view, job = self.view, self.job
        if view is not None and view.status is not None and job is not None:
            status = asdict(view.status)
            age_s = status.pop("age_s") + (now_s - job.view_s)
            return round(age_s * 1000), status
        look = self.watch.look
        if job is None and look is not None and not look.failed:
            return round((now_s - look.taken_s) * 1000), {"state": look.state}
        return None, {}

    def card(self, watcher: Watcher, now_s: float, *, seat: str = "") -> CellCard:
        """Return what the overview shows of it."""
        with speaking_in(watcher.language):
            if self.job is not None:
                return self._busy(watcher, self.job, seat)
            simulated, said = self.simulated, self.said
            card = card_of(self.watch, self.standing, now_s, simulated=simulated, said=said)
            if self.planned is not None:
                waits = self._planned(self.planned)
                mark = "look" if card.mark == "ok" else card.mark
                card = replace(card, mark=mark, lines=(waits, *card.lines))
            return replace(card, seat=seat, jobs=self.offers(watcher))

    def sign(self, now_s: float) -> str:
        """Return by what it is found among many cells: one of :data:`.cards.SIGNS`."""
        if self.job is not None:
            return "bad" if self._halted else "busy"
        mark = mark_of(self.watch, self.standing, now_s)
        # Nobody has looked at most of many cells; what is open there is on record all the same.
        waits = self.standing.is_open or self.planned is not None
        return "look" if waits and mark in ("unknown", "ok") else mark

    @property
    def _halted(self) -> bool:
        view = self.view
        return view is not None and view.status is not None and view.status.halted

    def offers(self, watcher: Watcher) -> tuple[JobOffer, ...]:
        """Return the jobs that can be begun, in the language that is spoken."""
        found = list[JobOffer]()
        for kind in filter(self._is_of_use, KINDS.values()):
            why_not = self._why_not(kind, watcher)
            if kind.of_plan:
                planned = self.planned
                assert planned is not None  # noqa: S101 - else it is of no use
                found.append(
                    JobOffer(
                        kind.name,
                        self._planned(planned),
                        planned.told(),
                        values={"plan": planned.plan.id},
                        why_not=why_not,
                    )
                )
            elif kind.of_recipe and self.recipes and self._names_differ():
                found += self._with_recipes(kind, why_not)
            elif kind.of_station:
                found += [
                    JobOffer(
                        kind.name,
                        self._learning(station),
                        values={"station": station},
                        why_not=why_not,
                    )
                    for station in self.cell.stations
                ]
            else:
                found.append(JobOffer(kind.name, spoken(kind.title), why_not=why_not))
        return tuple(found)

    @staticmethod
    def _planned(planned: PlannedJob) -> str:
        """Return what a plan's job is called."""
        return tr("Plan {name} waits for you here", name=planned.plan.name)

    def _learning(self, station: str) -> str:
        """Return what learning a station is called."""
        configured = self.cell.configured
        stations = (configured.settings.stations or {}) if configured is not None else {}
        if getattr(stations.get(station), "kind", "") == "camera":
            return tr("Teach the camera {station} again", station=station)
        return tr("Find the station {station} again", station=station)

    def _names_differ(self) -> bool:
        return len({one.name for one in self.recipes}) == len(self.recipes)

    def _with_recipes(self, kind: JobKind, why_not: str) -> list[JobOffer]:
        """Return a job with each recipe; of a single one the job itself tells more."""
        title = spoken(kind.title)
        if len(self.recipes) == 1:
            (one,) = self.recipes
            details = (tr("recipe: {name}", name=one.name), *one.told())
            return [JobOffer(kind.name, title, details, why_not=why_not)]
        return [
            JobOffer(
                kind.name,
                f"{title}: {one.name}",
                one.told(),
                values={"recipe": one.name},
                why_not=why_not,
            )
            for one in self.recipes
        ]

    def subject(self, kind: JobKind, given: object) -> str:
        """Return the file of a job's recipe, or its plan; empty where the press names none offered.

        Args:
            kind: The job.
            given: ``values`` of the press.
        """
        values = given if isinstance(given, Mapping) else {}
        if kind.of_plan:
            plan = "" if self.planned is None else self.planned.plan.id
            return plan if values.get("plan") == plan else ""
        named = values.get("recipe")
        if not kind.of_recipe or not self._names_differ():
            return ""
        return next((str(one.path) for one in self.recipes if one.name == named), "")

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
        if kind.of_plan:
            return self.planned is not None
        if kind.name == "release":
            look = self.watch.look
            held = look is not None and look.read.get("held_by_a_stop") is True
            return held or self.standing.stopped is not None
        return True

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
        if view is not None and view.head.step:
            lines.append(tr("Step {k} of {n}", k=view.head.step[0], n=view.head.step[1]))
        mark, word = "look", tr("job running")
        if self._halted and view is not None and view.status is not None:
            mark, word = "bad", view.status.state
        elif self.moving:
            word = tr("moving")
        lines += self.standing.past()
        simulated = self.simulated
        card = CellCard(self.name, mark, word, tuple(lines), simulated=simulated, busy=True)
        return replace(card, seat=seat or watcher.seat)


def may_begin(kind: JobKind, role: str) -> bool:
    """Return whether somebody with a role may begin a job."""
    return role == "engineer" or role == kind.role
