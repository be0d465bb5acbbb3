"""What a line computer is answered: to a job that it posts, and to the question what became of one.

A job is on record in the plant's database before the answer leaves. The same order again is
answered with the same job; nothing else comes of it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from robolink.errors import ConfigError
from robolink.files.toml import Problem
from robolink.fleet import (
    LineJob,
    LineJobError,
    LineJobStore,
    LineOrder,
    OpenLineJobsError,
    PlanProgress,
    PlantError,
    line_order_of,
    wait_in_words,
)
from robolink.messages import in_english, tr
from robolink_cli.panel.guard.line_gate import JOBS
from robolink_cli.panel.guard.line_tokens import LineToken
from robolink_cli.panel.plant.desk import PlantDesk

if TYPE_CHECKING:
    from pathlib import Path

    from robolink.config import Cell

AGAIN_S: Final = 5
"""After how many seconds a line computer is asked to try again while the database is away."""

ENDED_AGAIN_S: Final = 60
"""After how many seconds where too many of its jobs have not ended."""


@dataclass(frozen=True, slots=True)
class LineAnswer:
    """An answer to a line computer.

    Attributes:
        status: Of HTTP.
        document: The body.
        headers: Further headers.
    """

    status: int
    document: Mapping[str, object] = field(hash=False)
    headers: tuple[tuple[str, str], ...] = ()


class LineOrders:
    """Takes what line computers order.

    Args:
        desk: Asks the plant's database.
        cells: What the cell files say of each cell of this panel; ``None`` for nothing.
        groups: The words of each group of the cell files.
        note: Puts something on record: kind, cell, facts.
    """

    def __init__(
        self,
        desk: PlantDesk,
        cells: "Mapping[str, Cell | None]",
        groups: Mapping[str, Sequence[str]],
        note: Callable[..., None],
    ) -> None:
        self._desk, self._cells, self._groups, self._note = desk, cells, groups, note

    async def post(self, token: LineToken, said: Mapping[str, object]) -> LineAnswer:
        """Take a job, once.

        Args:
            token: Who asks.
            said: The body.
        """

        def taken(store: LineJobStore, confirm: Callable[[], None]) -> LineAnswer:
            return self._taken(token, said, store, confirm)

        return await self._answered(taken)

    async def look(self, token: LineToken, order: str) -> LineAnswer:
        """Tell how a job of this line computer stands.

        Args:
            token: Who asks.
            order: The id that it gave the job.
        """

        def found(store: LineJobStore, _confirm: Callable[[], None]) -> LineAnswer:
            job = store.line_job(token.name, order) if store.made else None
            if job is None:
                return refused(404, tr("There is no job of this order."))
            return LineAnswer(200, job_document(store, job))

        return await self._answered(found)

    async def _answered(
        self, question: Callable[[LineJobStore, Callable[[], None]], LineAnswer]
    ) -> LineAnswer:
        try:
            return await self._desk.ask(question)
        except PlantError as error:
            # Where the connection is lost in the commit itself, nobody knows. To repeat is safe.
            why = f"{in_english(error.what)} Post the same order again: it makes no second job."
            return LineAnswer(503, {"why": why}, (("Retry-After", str(AGAIN_S)),))
        except ConfigError as error:
            return refused(500, in_english(error.what))

    def _taken(
        self,
        token: LineToken,
        said: Mapping[str, object],
        store: LineJobStore,
        confirm: Callable[[], None],
    ) -> LineAnswer:
        try:
            asked = line_order_of(said)
        except LineJobError as error:
            return _wrong(error)
        if str(asked.kind) not in token.kinds:
            kinds = ", ".join(token.kinds)
            return refused(
                403, tr("This token orders no {kind}: {kinds}", kind=asked.kind, kinds=kinds)
            )
        if not token.allows(asked.cell, self._groups):
            return refused(403, tr("This token orders nothing at cell {cell}.", cell=asked.cell))
        if asked.permit not in ("", token.permit):
            why = tr("This token names no permit group {group}.", group=repr(asked.permit))
            return refused(403, why)
        job = store.line_job(token.name, asked.order)
        if not asked.permit:  # what is on record stays as it is when the token is replaced
            group = token.permit if job is None else str(job.fields.get("permit", ""))
            asked = replace(asked, permit=group)
        new = False
        if job is None:
            try:
                self._require_home(asked)
                plan = asked.plan(
                    token.name,
                    cells=tuple(self._cells),
                    recipes=self._recipes(asked.cell) if asked.recipe else {},
                    home=self._home(asked.cell),
                    plant=token.plant,
                )
            except LineJobError as error:
                return _wrong(error)
            try:
                job = store.order_job(token.name, asked, plan, confirm=confirm)
            except OpenLineJobsError as error:
                why = f"{in_english(error.what)} {in_english(error.remedy)}"
                return refused(429, why, ("Retry-After", str(ENDED_AGAIN_S)))
            new = job.plan == plan.id
        if differs := job.differs(asked):
            why = tr(
                "Order {order} was posted with another job before: {fields}.",
                order=asked.order,
                fields=", ".join(differs),
            )
            return LineAnswer(409, {"why": why, "differs": list(differs)})
        if new:
            who = f"{token.name} (line computer)"
            self._note("ordered", job.cell, who=who, order=job.order, plan=job.plan)
        where = f"{JOBS}/{quote(job.order, safe='')}"
        document = job_document(store, job)
        return LineAnswer(201 if new else 200, document, (("Location", where),))

    def _require_home(self, asked: LineOrder) -> None:
        """Refuse a job for a cell whose home is another computer: the panel there takes it.

        Raises:
            LineJobError: It is.
        """
        configured = self._cells.get(asked.cell)
        error = configured.home.refusal() if configured is not None else None
        if error is not None:
            raise LineJobError([Problem("cell", error.what)])

    def _home(self, cell: str) -> str:
        configured = self._cells.get(cell)
        return "" if configured is None else configured.home.computer

    def _recipes(self, cell: str) -> "Mapping[str, Path]":
        """Return the recipes of a cell by their names; two of one name are none."""
        from robolink_cli.session.cell_recipes import recipes_for

        configured = self._cells.get(cell)
        if configured is None:
            return {}
        found = [loaded for loaded, _ in recipes_for(configured)]
        names = [loaded.name for loaded in found]
        return {loaded.name: loaded.path for loaded in found if names.count(loaded.name) == 1}


def job_document(store: LineJobStore, job: LineJob) -> dict[str, object]:
    """Return how a job stands, as plain JSON.

    Args:
        store: The plant's database.
        job: The job.
    """
    progress = store.progress(job.plan)
    return {
        "schema": "robolink/line-job/1",
        "order": job.order,
        "cell": job.cell,
        "kind": str(progress.plan.kind),
        "posted_at": job.posted_at,
        "plan": job.plan,
        **_standing(progress),
    }


def _standing(progress: PlanProgress) -> dict[str, object]:
    (job,) = progress.jobs
    why = progress.why(job)
    return {
        "journal_order": job.order,
        "state": str(job.state),
        "final": job.state.final,
        "why": None if why is None else str(why),
        "waits_for": None if why is None else in_english(wait_in_words(why)),
        "halts": [in_english(halt.sentence) for halt in progress.standing],
        "attempt_count": job.attempt,
        "begun_at": job.begun_at or None,
        "ended_at": job.ended_at or None,
        "exit_code": job.code,
        "error": job.error or None,
        "reason": job.reason or None,
        "what": job.what or None,
        "change": job.change or None,
    }


def refused(status: int, why: str, *headers: tuple[str, str]) -> LineAnswer:
    """Return an answer that says why not.

    Args:
        status: Of HTTP.
        why: A sentence.
        headers: Further headers.
    """
    return LineAnswer(status, {"why": in_english(why)}, headers)


def _wrong(error: LineJobError) -> LineAnswer:
    problems = [{"field": one.where, "what": in_english(one.what)} for one in error.problems]
    return LineAnswer(422, {"why": "This cannot be ordered.", "problems": problems})
