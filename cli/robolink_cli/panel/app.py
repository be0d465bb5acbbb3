"""What the panel answers: pages, the live stream, presses, STOP.

No GET changes anything. Who may ask for what is looked at before, in
:mod:`robolink_cli.panel.guard`; what a question takes, its job alone decides.
"""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from typing import Any, Final
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from robolink.errors import RobolinkError
from robolink.locale.languages import language_named
from robolink.messages import in_english, tr
from robolink_cli.panel.board import may_begin
from robolink_cli.panel.cards import CellChoice, ChangeRow, ChartCard
from robolink_cli.panel.guard.access import Access
from robolink_cli.panel.guard.answers import nothing_here, posted, refused, short_text
from robolink_cli.panel.guard.live import ANYTIME
from robolink_cli.panel.guard.pairing import Tablet
from robolink_cli.panel.guard.requests import MOST_BYTES, parsed
from robolink_cli.panel.history import changes_of, charts_of, page_of
from robolink_cli.panel.hub import Hub, LivePage
from robolink_cli.panel.jobs import KINDS, end_all, options_of
from robolink_cli.panel.pages import HERE, Pages, Watcher
from robolink_cli.panel.plant.desk import PlantDesk
from robolink_cli.panel.plant.plan_pages import PlanPages
from robolink_cli.panel.plant.plan_watch import PlanWatch
from robolink_cli.panel.stop import StopAnswer, StopAsked, StopDesk
from robolink_cli.panel.tastes import Tastes
from robolink_cli.panel.words import speaking_in

LEAVE_S: Final = 60.0
"""How long the end of the panel waits for its jobs to end in order, in s."""

_STATIC: Final = {
    "panel.css": "text/css; charset=utf-8",
    "panel.js": "text/javascript; charset=utf-8",
    "panel.svg": "image/svg+xml",
}
LATE_AFTER_MS: Final = 1500.0
"""Age of a press in ms from which it does nothing. A page is grey after 1000."""

_ID: Final = 12
"""Digits of a tablet's id that go on record."""


class Panel:
    """The application.

    Args:
        hub: The cells and the pages that are open.
        stops: Takes the presses of STOP.
        access: Who asks.
        tastes: How each tablet wants its pages.
        looking: Asks the plant's database how plans stand.
        ordering: Asks it for what somebody waits for.
    """

    def __init__(
        self,
        hub: Hub,
        stops: StopDesk,
        access: Access,
        tastes: Tastes,
        *,
        looking: PlantDesk,
        ordering: PlantDesk,
    ) -> None:
        self.hub, self._stops, self._access, self._tastes = hub, stops, access, tastes
        self._seats, self._note = access.seats, access.audit.note
        self._pages: Pages = hub.pages
        watch = PlanWatch(looking, hub.plans_changed)
        self.plans = PlanPages(watch, ordering, self._pages, access, self._watcher)

    def application(self) -> Starlette:
        """Return it for a server."""
        return Starlette(
            routes=[
                Route("/", self._overview),
                Route("/cell/{cell}", self._cell),
                Route("/cell/{cell}/history", self._history),
                Route("/cell/{cell}/picture", self._picture),
                Route("/cell/{cell}/report/{change}", self._report),
                *self.plans.routes(),
                Route("/login", self._login),
                Route("/pair", self._pair),
                Route("/static/{name}", self._static),
                WebSocketRoute("/live", self._live),
                Route("/stop", self._stop, methods=["POST"]),
                Route("/stop-all", self._stop_all, methods=["POST"]),
                Route("/seat", self._take_seat, methods=["POST"]),
                Route("/seat/leave", self._leave_seat, methods=["POST"]),
                Route("/start", self._start, methods=["POST"]),
                Route("/tablet", self._set_taste, methods=["POST"]),
            ],
            exception_handlers={RobolinkError: _told},  # type: ignore[dict-item]
            lifespan=self._living,
        )

    @asynccontextmanager
    async def _living(self, _: Starlette) -> AsyncIterator[None]:
        runs = [asyncio.ensure_future(one.run()) for one in (self.hub, self.plans.watch)]
        try:
            yield
        finally:
            for one in runs:
                one.cancel()
            jobs = [board.job for board in self.hub.boards.values() if board.job is not None]
            await end_all(jobs, LEAVE_S)

    # Pages.

    def _watcher(self, asked: HTTPConnection, cell: str = "") -> Watcher:
        """Return who looks at a cell's page, or at all cells."""
        tablet = self._access.tablet_of(asked.scope)
        taste = self._tastes.of(tablet.id)
        seat = ""
        board = self.hub.boards.get(cell)
        if board is not None:
            holder = self._seats.holder(cell, moving=board.moving)
            if self._seats.has(cell, tablet.id):
                seat = HERE
            elif holder is not None:
                with speaking_in(taste.language):
                    seat = holder.who or tr("the tablet at {address}", address=holder.address)
        role = tablet.session.role if tablet.session else ""
        young = tablet.session is None or self._access.logins.is_fresh(tablet.session)
        return Watcher(taste.language, taste.dark, seat, tablet.who, role, tablet.paired, young)

    def _token(self, asked: HTTPConnection) -> str:
        return self._access.token_of(asked.scope)

    async def _overview(self, request: Request) -> Response:
        watcher, choice = self._watcher(request), CellChoice.of(request.query_params)
        self.hub.has_plans = self.plans.watch.present
        parts = self.hub.overview(watcher, time.monotonic(), choice)
        token, query = self._token(request), choice.query
        return HTMLResponse(
            self._pages.page("overview", watcher, parts=parts, token=token, query=query)
        )

    async def _cell(self, request: Request) -> Response:
        name = request.path_params["cell"]
        board = self.hub.boards.get(name)
        if board is None:
            return nothing_here()
        watcher = self._watcher(request, name)
        return HTMLResponse(
            self._pages.page(
                "cell",
                watcher,
                cell=name,
                parts=board.parts(self._pages, watcher, time.monotonic()),
                number=board.number,
                token=self._token(request),
            )
        )

    async def _history(self, request: Request) -> Response:
        board = self.hub.boards.get(request.path_params["cell"])
        if board is None:
            return nothing_here()
        watcher, url = self._watcher(request, board.name), board.cell.url

        def found() -> tuple[tuple[ChangeRow, ...], tuple[ChartCard, ...]]:
            return changes_of(url), charts_of(url)

        changes, charts = await asyncio.to_thread(found)
        return HTMLResponse(
            self._pages.page(
                "history",
                watcher,
                cell=board.name,
                changes=changes,
                charts=charts,
                simulated=board.simulated,
                token=self._token(request),
            )
        )

    async def _report(self, request: Request) -> Response:
        board = self.hub.boards.get(request.path_params["cell"])
        if board is None:
            return nothing_here()
        change = request.path_params["change"]
        return HTMLResponse(await asyncio.to_thread(page_of, board.cell.url, change))

    async def _picture(self, request: Request) -> Response:
        """Answer with the newest picture of the cell's camera, a PNG file."""
        board = self.hub.boards.get(request.path_params["cell"])
        if board is None or board.camera is None:
            return nothing_here()
        # Circles of one picture on another would lie.
        if request.query_params.get("v") != board.camera.stamp:
            return nothing_here()
        return Response(board.camera.picture.png, media_type="image/png")

    async def _login(self, request: Request) -> Response:
        return self._about_people("login", request)

    async def _pair(self, request: Request) -> Response:
        return self._about_people("pairing", request)

    def _about_people(self, kind: str, request: Request) -> Response:
        cell = request.query_params.get("cell", "")
        plan = request.query_params.get("plan", "")
        onward = f"/cell/{quote(cell)}" if cell in self.hub.boards else "/"
        onward = f"/plan/{quote(plan)}" if plan.isalnum() else onward
        people = self._access.people.values()
        names = sorted({name for of_cell in people for name in of_cell or ()})
        watcher, token = self._watcher(request), self._token(request)
        return HTMLResponse(
            self._pages.page(kind, watcher, names=names, onward=onward, token=token)
        )

    async def _static(self, request: Request) -> Response:
        name = request.path_params["name"]
        kind = _STATIC.get(name)
        if kind is None:
            return nothing_here()
        content = files("robolink_cli.panel").joinpath("static", name).read_bytes()
        return Response(content, media_type=kind)

    # The live stream.

    async def _live(self, socket: WebSocket) -> None:
        cell = socket.query_params.get("cell", "")
        if cell and cell not in self.hub.boards:
            await socket.close(4404)
            return
        await socket.accept()
        tablet = self._access.tablet_of(socket.scope)

        async def send(frame: Mapping[str, object]) -> None:
            if frame.get("t") == "beat":
                frame = {**frame, "at_ms": self._stops.at_ms()}
            await socket.send_text(json.dumps(frame, ensure_ascii=False, separators=(",", ":")))

        said = socket.query_params
        live = LivePage(
            send,
            lambda: self._watcher(socket, cell),
            tablet.id,
            cell,
            draw=None if cell else self.plans.drawing(said),
            choice=CellChoice.of(said),
        )
        token = self._token(socket)
        await send({"t": "hello", "server": self.hub.server, "token": token})
        listens = asyncio.ensure_future(self._listen(socket, live))
        shows = asyncio.ensure_future(self.hub.show(live))
        try:
            await asyncio.wait((listens, shows), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (listens, shows):
                task.cancel()
            await asyncio.gather(listens, shows, return_exceptions=True)
            with suppress(RuntimeError, OSError, WebSocketDisconnect):
                await socket.close()

    async def _listen(self, socket: WebSocket, live: LivePage) -> None:
        """Take what a tablet sends, until it is gone."""
        with suppress(WebSocketDisconnect):
            while True:
                text = await socket.receive_text()
                frame = parsed(text) if len(text) <= MOST_BYTES else None
                live.heard_s = time.monotonic()
                self._seats.heard(live.tablet)
                if frame is not None:
                    self._hear(socket, live, frame)

    def _hear(self, socket: WebSocket, live: LivePage, frame: Mapping[str, Any]) -> None:
        match frame.get("t"):
            case "stop":
                self.hub.spawn(self._stop_by_stream(socket, live, frame))
            case "press":
                why = self._press(socket, live, frame)
                if why:
                    said = {"t": "refused", "press": short_text(frame.get("press")), "why": why}
                    self.hub.spawn(self._tell(live, said))
            case "hold" | "beat" | "release" as what:
                self._held(socket, live, what, frame)

    async def _tell(self, live: LivePage, frame: Mapping[str, object]) -> None:
        with suppress(RuntimeError, OSError, WebSocketDisconnect):
            await live.send(frame)

    # Presses.

    def _press(self, socket: WebSocket, live: LivePage, frame: Mapping[str, Any]) -> str:
        """Pass a press on to the job; return why it is refused, empty where it is not."""
        tablet = self._access.tablet_of(socket.scope)
        action, value = short_text(frame.get("action")), short_text(frame.get("value"))
        facts = {"tablet": tablet.id[:_ID], "who": tablet.who, "action": action, "value": value}
        board = self.hub.boards.get(live.cell)
        job = board.job if board is not None else None
        if self._is_late(frame):
            self._note("refused", live.cell, why="late", **facts)
            with speaking_in(self._tastes.of(tablet.id).language):
                return tr("The press came too late. Nothing was done. Press again.")
        if board is None or job is None or frame.get("number") != board.number:
            self._note("refused", live.cell, why="number", **facts)
            with speaking_in(self._tastes.of(tablet.id).language):
                return tr("The screen has changed. Nothing was pressed.")
        why = self._access.why_not_answer(tablet, live.cell, job.who)
        if why and action not in ANYTIME:
            self._note("refused", live.cell, why="role", **facts)
            return why
        question = in_english(job.view.head.title) if job.view is not None else ""
        self._note("answer", live.cell, question=question, **facts)
        job.press(board.question(), action, value)
        return ""

    def _is_late(self, frame: Mapping[str, Any]) -> bool:
        """Return whether what a finger did was sent long ago: its cable was out meanwhile."""
        at_ms = frame.get("at_ms")
        return at_ms is not None and self._stops.age_ms(None, at_ms) > LATE_AFTER_MS

    def _held(self, socket: WebSocket, live: LivePage, what: str, frame: Mapping[str, Any]) -> None:
        """Pass a finger on a key that repeats on to the job."""
        board, finger = self.hub.boards.get(live.cell), short_text(frame.get("finger"))
        job = board.job if board is not None else None
        if board is None or job is None or not finger:
            return
        if what == "release" or self._is_late(frame):
            job.release(finger)
        elif what == "beat":
            job.beat(finger)
        elif frame.get("number") == board.number:
            tablet, axis = self._access.tablet_of(socket.scope), short_text(frame.get("axis"))
            if self._access.why_not_answer(tablet, live.cell, job.who):
                return
            facts = {"tablet": tablet.id[:_ID], "who": tablet.who, "action": "hold"}
            self._note("answer", live.cell, value=axis, **facts)
            job.hold(board.question(), axis, finger)

    # STOP.

    async def _stop_by_stream(
        self, socket: WebSocket, live: LivePage, frame: Mapping[str, Any]
    ) -> None:
        everywhere = live.cell == ""
        cells = self._of_this_panel() if everywhere else [live.cell]
        answer = await self._carry_out(socket, frame, cells, everywhere=everywhere)
        await self._tell(live, answer)

    async def _stop(self, request: Request) -> Response:
        said = await posted(request)
        cell = short_text(said.get("cell"))
        if cell not in self.hub.boards:
            return nothing_here()
        return JSONResponse(await self._carry_out(request, said, [cell], everywhere=False))

    async def _stop_all(self, request: Request) -> Response:
        said = await posted(request)
        cells = self._of_this_panel()
        return JSONResponse(await self._carry_out(request, said, cells, everywhere=True))

    def _of_this_panel(self) -> list[str]:
        return [board.name for board in self.hub.boards.values() if board.job is not None]

    async def _carry_out(
        self, asked: HTTPConnection, said: Mapping[str, Any], cells: list[str], *, everywhere: bool
    ) -> dict[str, object]:
        tablet = self._access.tablet_of(asked.scope)
        taste, press = self._tastes.of(tablet.id), short_text(said.get("press"))
        if not tablet.paired:
            with speaking_in(taste.language):
                why = tr("This tablet is not paired: it stops nothing. Press the red button.")
            return {"t": "stopped", "press": press, "outcome": "failed", "text": why}
        with speaking_in(taste.language):
            who = tablet.who or tr("the tablet at {address}", address=tablet.address)
        age_ms = self._stops.age_ms(said.get("age_ms"), said.get("at_ms"))
        wanted = tuple(StopAsked(cell, who, taste.language) for cell in cells)
        answer = await self._stops.press(press, age_ms, wanted, everywhere=everywhere)
        self._record(answer, tablet, press, cells)
        return {"t": "stopped", "press": press, "outcome": answer.outcome, "text": answer.text}

    def _record(self, answer: StopAnswer, tablet: Tablet, press: str, cells: list[str]) -> None:
        for cell in cells:
            facts = {"tablet": tablet.id[:_ID], "who": tablet.who, "press": press}
            self._note("stop", cell, outcome=str(answer.outcome), **facts)
            self.hub.spawn(self.hub.read_standing(self.hub.boards[cell]))

    # Seats and jobs.

    async def _take_seat(self, request: Request) -> Response:
        said = await posted(request)
        board = self.hub.boards.get(short_text(said.get("cell")))
        if board is None:
            return nothing_here()
        tablet = self._access.tablet_of(request.scope)
        facts = {"tablet": tablet.id[:_ID], "who": tablet.who}
        taken = self._seats.take(board.name, tablet, moving=board.moving)
        if taken.why_not:
            self._note("refused", board.name, why="moving", action="seat", **facts)
            return refused(taken.why_not)
        if taken.from_whom is not None:
            facts["before"] = taken.from_whom.who
        self._note("seat", board.name, **facts)
        board.renew()
        return JSONResponse({})

    async def _leave_seat(self, request: Request) -> Response:
        said = await posted(request)
        board = self.hub.boards.get(short_text(said.get("cell")))
        if board is None:
            return nothing_here()
        tablet = self._access.tablet_of(request.scope)
        self._seats.leave(board.name, tablet.id, moving=board.moving)
        self._note("seat_left", board.name, tablet=tablet.id[:_ID], who=tablet.who)
        board.renew()
        return JSONResponse({})

    async def _start(self, request: Request) -> Response:
        said = await posted(request)
        board = self.hub.boards.get(short_text(said.get("cell")))
        kind = KINDS.get(short_text(said.get("job")))
        if board is None or kind is None:
            return nothing_here()
        tablet = self._access.tablet_of(request.scope)
        taste = self._tastes.of(tablet.id)
        facts = {
            "tablet": tablet.id[:_ID],
            "who": tablet.who,
            "action": "start",
            "value": kind.name,
        }
        role = self._access.role(tablet.who, board.name)
        station = board.station(kind, said.get("values"))
        subject = board.subject(kind, said.get("values"))
        why = ""
        if role is None or not may_begin(kind, role):
            why = tr("This takes an engineer.")
        elif board.job is not None:
            why = tr("A job is running on this cell already.")
        elif kind.of_station and station is None:
            why = tr("This cell has no such station.")
        elif kind.of_recipe and _names_a_recipe(said.get("values")) and not subject:
            why = tr("This recipe is not offered any more. Choose again.")
        elif kind.of_plan and not subject:
            why = tr("This job of a plan is not offered any more. Choose again.")
        if why:
            self._note("refused", board.name, why=in_english(why), **facts)
            return refused(why)
        self._note("answer", board.name, question="which job", **facts)
        try:
            await self.hub.begin(
                board,
                kind,
                language=taste.language,
                who=tablet.who,
                values=options_of(kind, said.get("values")),
                station=station,
                subject=subject,
            )
        except OSError as error:
            cause = error.strerror or str(error)
            return refused(tr("The job could not be started: {cause}.", cause=cause))
        return JSONResponse({})

    async def _set_taste(self, request: Request) -> Response:
        said = await posted(request)
        tablet = self._access.tablet_of(request.scope)
        language, dark = language_named(short_text(said.get("language"))), said.get("dark")
        self._tastes.set(tablet.id, language, dark if isinstance(dark, bool) else None)
        self.hub.everything_changed(tablet.id)
        return JSONResponse({})


async def _told(_: Request, error: RobolinkError) -> Response:
    """Answer with what is wrong and what to do, in place of a page."""
    return PlainTextResponse(f"{error.what}\n{error.remedy}", 503)


def _names_a_recipe(given: object) -> bool:
    return isinstance(given, Mapping) and "recipe" in given
