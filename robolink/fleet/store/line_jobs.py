"""The store of a plant that line computers order jobs from, each once."""

import json
from collections.abc import Callable, Sequence
from typing import Any, Final

from robolink.fleet.line_jobs import LineJob, LineOrder, OpenLineJobsError
from robolink.fleet.plans import Plan
from robolink.fleet.store import statements
from robolink.fleet.store.course import PlanCourse, added_plan
from robolink.fleet.store.homes import require_one_computer
from robolink.fleet.store.rows import label_of
from robolink.fleet.store.store import FleetStore
from robolink.journal.store.chain import canonical

MOST_OPEN: Final = 50
"""Jobs of one line computer that have not ended. Each turn of an agent asks for all of them."""


class LineJobStore(FleetStore):
    """Keeps the jobs of line computers beside the plans that they became.

    The id of an order counts for its line computer: another one may use the same.

    Example:
        >>> from robolink.fleet import LineJobStore, line_order_of
        >>> asked = line_order_of({"order": "A-17/3", "cell": "line3-a", "kind": "check"})
        >>> plan = asked.plan("mes", cells=["line3-a"], recipes={})
        >>> with LineJobStore("line-jobs.db") as store:
        ...     first = store.order_job("mes", asked, plan)
        ...     again = store.order_job("mes", asked, plan)
        ...     first.plan == again.plan == plan.id, store.progress(plan.id).jobs[0].cell
        (True, 'line3-a')
    """

    def order_job(
        self,
        line: str,
        asked: LineOrder,
        plan: Plan,
        *,
        confirm: Callable[[], None] = lambda: None,
    ) -> LineJob:
        """Keep a job and its plan, which starts with that; one that is there already stays so.

        On a server, this computer carries it out if no cell file names the home of its cell. Of a
        line computer :data:`MOST_OPEN` jobs may be open. Where panels keep jobs of the same one at
        the same instant, each panel may exceed that by one.

        Args:
            line: The line computer.
            asked: What it asks for.
            plan: The plan that this becomes.
            confirm: Called as the last thing before it is kept: what it raises, undoes all.

        Example:
            >>> from robolink.fleet import LineJobStore, line_order_of
            >>> said = {"order": "A-18", "cell": "line3-a", "kind": "check"}
            >>> asked = line_order_of(said)
            >>> other = line_order_of({**said, "kind": "backup"})
            >>> with LineJobStore("ordered.db") as store:
            ...     for one in (asked, other):
            ...         plan = one.plan("mes", cells=["line3-a"], recipes={})
            ...         print(store.order_job("mes", one, plan).differs(one))
            ()
            ('kind',)

        Returns:
            The job on record: with this id, it may be another than the one that is asked for
            (:meth:`LineJob.differs`).

        Raises:
            OpenLineJobsError: So many of its jobs have not ended; nothing was kept.
            PlanError: The cell has its home elsewhere, and the database is a file.
            PlantError: The database cannot be used; nothing was kept, or the connection was lost
                at the very end.
        """
        now = self._clock()
        if not self._database.shared:
            require_one_computer(plan, self.home, self.name)
        values = {
            "line": line,
            "order_id": asked.order,
            "plan": plan.id,
            "cell": asked.cell,
            "at": label_of(now),
            "body": canonical(asked.fields()),
        }
        with self._database.transaction() as database:
            # This first: of two that post the same at once, one waits here for the other's end.
            if database.run(statements.ADD_LINE_JOB, values):
                ((count,),) = database.rows(statements.OPEN_LINE_JOBS, {"line": line})
                if count >= MOST_OPEN:
                    raise OpenLineJobsError(line, MOST_OPEN)
                added_plan(database, plan, now)
                if self._database.shared:  # the line asked the panel of this computer, no other
                    PlanCourse(database, plan, now).bind(self.home)
            rows = database.rows(statements.LINE_JOB, {"line": line, "order_id": asked.order})
            confirm()
        return _read(rows[0])

    def line_job(self, line: str, order: str) -> LineJob | None:
        """Return a job by the line computer's id; ``None`` where it never came.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            rows = database.rows(statements.LINE_JOB, {"line": line, "order_id": order})
        return _read(rows[0]) if rows else None

    def line_jobs(self, order: str) -> tuple[LineJob, ...]:
        """Return the jobs of that id, of every line computer.

        Raises:
            PlantError: The database cannot be used.
        """
        with self._database.transaction() as database:
            return tuple(map(_read, database.rows(statements.LINE_JOBS, {"order_id": order})))


def _read(row: Sequence[Any]) -> LineJob:
    said = dict(zip(statements.LINE_JOB_COLUMNS, row, strict=True))
    fields = json.loads(said.pop("body"))
    return LineJob(order=said.pop("order_id"), fields=fields, **said)
