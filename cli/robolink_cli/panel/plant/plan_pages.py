"""The pages of plans: a list, one plan, and the two presses of an engineer, halt and resume.

Whoever may look at the panel may look at them. What they show was heard before; no request waits
for the database longer than :data:`~robolink_cli.panel.plant.desk.ANSWER_S`.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import quote

from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from robolink import __version__
from robolink.errors import ConfigError
from robolink.fleet import LineJobStore
from robolink.journal import signature_here
from robolink.messages import in_english, tr
from robolink.model import PersonRole
from robolink_cli.panel.guard.access import Access
from robolink_cli.panel.guard.answers import nothing_here, posted, refused, short_text
from robolink_cli.panel.guard.pairing import Tablet
from robolink_cli.panel.pages import Pages, Parts, Watcher
from robolink_cli.panel.plant.desk import PlantDesk
from robolink_cli.panel.plant.plan_cards import PlanChoice, plan_sight, plans_sight
from robolink_cli.panel.plant.plan_watch import PlantSight, PlanWatch
from robolink_cli.panel.words import speaking_in

_ID: Final = 12
"""Digits of a tablet's id that go on record."""

_DRAWN_S: Final = 5.0
"""For so long in s what was drawn is kept while nothing new is heard."""

_MOST_DRAWN: Final = 64


@dataclass(frozen=True, slots=True)
class _Decision:
    """What a person decided about a plan, and the last halt that was seen then; 0 for none."""

    plan: str
    who: str
    reason: str
    seen: int


class PlanPages:
    """Answers with pages of plans.

    Args:
        watch: Looks at the plans.
        desk: Asks the plant's database what a person decided.
        pages: Draws.
        access: Who asks.
        watcher: Returns who looks, for a request.
    """

    def __init__(
        self,
        watch: PlanWatch,
        desk: PlantDesk,
        pages: Pages,
        access: Access,
        watcher: Callable[[HTTPConnection], Watcher],
    ) -> None:
        self.watch = watch
        self._desk, self._pages, self._access, self._watcher = desk, pages, access, watcher
        self._drawn: dict[tuple[object, Watcher], tuple[PlantSight, float, Parts]] = {}

    def routes(self) -> list[Route]:
        """Return their addresses."""
        return [
            Route("/plans", self._plans),
            Route("/plan/{plan}", self._plan),
            Route("/plan/{plan}/{decision}", self._decision),
            Route("/plan/halt", self._halt, methods=["POST"]),
            Route("/plan/resume", self._resume, methods=["POST"]),
        ]

    def drawing(self, said: Mapping[str, str]) -> Callable[[Watcher, float], Parts] | None:
        """Return what draws the page that a stream follows; ``None`` where it is none of plans.

        Args:
            said: The parameters of the stream.
        """
        if "plans" in said:
            return self._draw_plans
        if "plan" in said:
            choice = PlanChoice.of(said["plan"], said)
            return lambda watcher, _now_s: self._draw_plan(choice, watcher)
        return None

    # ---- Pages

    async def _plans(self, request: Request) -> Response:
        await self.watch.first()
        watcher = self._watcher(request)
        parts = self._draw_plans(watcher, 0.0)
        return self._whole("plans", request, watcher, parts=parts, query="plans=1")

    async def _plan(self, request: Request) -> Response:
        choice = PlanChoice.of(request.path_params["plan"], request.query_params)
        sight = await self.watch.first(choice.plan)
        if choice.plan in sight.opened and sight.opened[choice.plan] is None:
            return nothing_here()
        watcher = self._watcher(request)
        parts = self._draw_plan(choice, watcher)
        return self._whole("plan", request, watcher, parts=parts, query=choice.query)

    async def _decision(self, request: Request) -> Response:
        choice = PlanChoice.of(request.path_params["plan"], {})
        decision = request.path_params["decision"]
        if decision not in ("halt", "resume"):
            return nothing_here()
        sight = await self.watch.first(choice.plan)
        progress = sight.opened.get(choice.plan)
        if progress is None:
            known = choice.plan in sight.opened
            return nothing_here() if known else refused(tr("The plans cannot be read now."), 503)
        watcher = self._watcher(request)
        with speaking_in(watcher.language):
            shown = plan_sight(sight, progress, choice)
        onward = f"/plan/{quote(choice.plan)}"
        resumes = decision == "resume"
        return self._whole(
            "decision", request, watcher, sight=shown, resumes=resumes, onward=onward
        )

    def _whole(self, kind: str, request: Request, watcher: Watcher, **data: Any) -> Response:  # noqa: ANN401 - of the page
        token = self._access.token_of(request.scope)
        return HTMLResponse(self._pages.page(kind, watcher, token=token, **data))

    def _draw_plans(self, watcher: Watcher, _now_s: float) -> Parts:
        sight = self.watch.want()
        return self._kept("plans", watcher, sight, lambda: self._plans_parts(sight, watcher))

    def _plans_parts(self, sight: PlantSight, watcher: Watcher) -> Parts:
        with speaking_in(watcher.language):
            return self._pages.of_plans("plans", plans_sight(sight), watcher)

    def _draw_plan(self, choice: PlanChoice, watcher: Watcher) -> Parts:
        sight = self.watch.want(choice.plan)
        return self._kept(choice, watcher, sight, lambda: self._plan_parts(sight, choice, watcher))

    def _plan_parts(self, sight: PlantSight, choice: PlanChoice, watcher: Watcher) -> Parts:
        progress = sight.opened.get(choice.plan)
        if progress is None:  # heard of others only, or gone: the list says when
            return self._plans_parts(sight, watcher)
        with speaking_in(watcher.language):
            return self._pages.of_plans("plan", plan_sight(sight, progress, choice), watcher)

    def _kept(
        self, what: object, watcher: Watcher, sight: PlantSight, draw: Callable[[], Parts]
    ) -> Parts:
        """Return what was drawn, drawn anew where something else was heard since."""
        now_s = time.monotonic()
        key = (what, watcher)
        kept = self._drawn.get(key)
        if kept is not None and kept[0] is sight and now_s - kept[1] < _DRAWN_S:
            return kept[2]
        while len(self._drawn) >= _MOST_DRAWN:
            del self._drawn[next(iter(self._drawn))]
        parts = draw()
        self._drawn[key] = (sight, now_s, parts)
        return parts

    # ---- Decisions of an engineer

    async def _halt(self, request: Request) -> Response:
        def halt(store: LineJobStore, said: _Decision, confirm: Callable[[], None]) -> None:
            store.halt(said.plan, said.who, said.reason, confirm=confirm)

        return await self._decided(request, "plan_halted", halt)

    async def _resume(self, request: Request) -> Response:
        def resume(store: LineJobStore, said: _Decision, confirm: Callable[[], None]) -> None:
            halts = store.progress(said.plan).halts
            last = next((halt for halt in halts if halt.number == said.seen), None)
            if last is None:
                raise ConfigError(
                    tr("Plan {plan} has no such halt.", plan=said.plan),
                    remedy=tr("Look at the plan again."),
                )
            store.resume(said.plan, said.who, said.reason, seen=last, confirm=confirm)

        return await self._decided(request, "plan_resumed", resume)

    async def _decided(
        self,
        request: Request,
        kind: str,
        decide: Callable[[LineJobStore, _Decision, Callable[[], None]], None],
    ) -> Response:
        said = await posted(request)
        plan, reason = short_text(said.get("plan")), short_text(said.get("reason")).strip()
        seen = said.get("seen", 0)
        tablet = self._access.tablet_of(request.scope)
        facts = {"tablet": tablet.id[:_ID], "who": tablet.who, "plan": plan, "reason": reason}
        why = ""
        if not reason or not reason.isprintable():
            why = tr("Say why, in one line: it goes on record.")
        elif not isinstance(seen, int):
            why = tr("The panel does not understand this message.")
        else:
            why = await self._why_not_here(tablet, plan)
        if why:
            self._access.audit.note("refused", "", why=in_english(why), action=kind, **facts)
            return refused(why)
        decision = _Decision(plan, _in_whose_name(tablet), reason, seen)
        try:
            await self._desk.ask(lambda store, confirm: decide(store, decision, confirm))
        except ConfigError as error:
            self._access.audit.note("refused", "", why=in_english(error.what), action=kind, **facts)
            return refused(f"{error.what} {error.remedy or ''}".strip())
        self._access.audit.note(kind, "", **facts, seen=seen)
        self.watch.look_again()
        return JSONResponse({})

    async def _why_not_here(self, tablet: Tablet, plan: str) -> str:
        """Return why a person may not decide about a plan: of a cell here, no engineer is who asks.

        The gate has seen that it is an engineer, with a PIN of the last 15 minutes.
        """
        try:
            found = await self._desk.ask(lambda store, _confirm: store.plan(plan).cells)
        except ConfigError as error:
            return f"{error.what} {error.remedy or ''}".strip()
        others = [
            cell
            for cell in found
            if cell in self._access.people
            and self._access.role_at(tablet, cell) is not PersonRole.ENGINEER
        ]
        if others:
            return tr("At {cell}, of this plan, you are no engineer.", cell=others[0])
        return ""


def _in_whose_name(tablet: Tablet) -> str:
    """Return who decides, for the plan's record: the person, the user and the computer."""
    here = signature_here(__version__)
    return f"{tablet.who or 'PIN of the panel'}, panel ({here.os_user}@{here.host})"
