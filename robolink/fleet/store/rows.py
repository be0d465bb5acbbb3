"""From rows of the plant's database to plans, jobs, halts and permits."""

import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, NamedTuple

from robolink.fleet.corrections import TipCorrection
from robolink.fleet.errors import PlanError
from robolink.fleet.halts import Accepted, HaltRule, Key
from robolink.fleet.outcome_codes import Treatment
from robolink.fleet.plans import Plan
from robolink.fleet.progress import CellJob, Halt, Permit
from robolink.fleet.states import JobState
from robolink.fleet.store import statements
from robolink.journal.store.chain import storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import known_names, tr


def label_of(now: datetime) -> str:
    """Return a time as it is stored: ISO 8601, UTC, whole seconds."""
    return now.astimezone(UTC).isoformat(timespec="seconds")


@lru_cache(maxsize=256)
def read_plan(document: str) -> Plan:
    """Return a plan from its document."""
    return Plan.from_document(json.loads(document))


class StoredPlan(NamedTuple):
    """A plan as it is stored.

    Attributes:
        plan: The plan.
        cancelled_at: When it was cancelled; empty where it was not.
        bound_to: The computer that carries it out, where its cells name no home and one has begun.
    """

    plan: Plan
    cancelled_at: str
    bound_to: str


def plan_in(database: DatabaseConnection, plan: str) -> StoredPlan:
    """Return a plan by its id.

    Raises:
        PlanError: There is none of that id, or it was changed.
    """
    rows = database.rows(statements.PLAN, {"plan": plan})
    if not rows:
        raise unknown_plan(database, plan)
    document, cancelled_at, bound_to = rows[0]
    return StoredPlan(read_plan(document), cancelled_at, bound_to)


def unknown_plan(database: DatabaseConnection, plan: str) -> PlanError:
    """Return the error of an id that no plan has."""
    ids = [read_plan(document).id for document, _ in database.rows(statements.PLANS)]
    return PlanError(
        tr("There is no plan {plan}.", plan=plan),
        remedy=known_names(ids, plan) if ids else tr("Make a plan first."),
    )


def read_job(row: Sequence[Any]) -> CellJob:
    """Return a job from its row."""
    said = dict(zip(statements.JOB_COLUMNS, row, strict=True))
    said["state"] = JobState(said["state"])
    said["treatment"] = Treatment(said["treatment"]) if said["treatment"] else None
    return CellJob(**said)


def read_halt(row: Sequence[Any]) -> Halt:
    """Return a halt from its row."""
    said = dict(zip(statements.HALT_COLUMNS, row, strict=True))
    said["rule"], said["numbers"] = HaltRule(said["rule"]), json.loads(said["numbers"])
    said["by"] = said.pop("by_whom")
    return Halt(**said)


def read_permit(row: Sequence[Any]) -> Permit:
    """Return a permit from its row."""
    said = dict(zip(statements.PERMIT_COLUMNS, row, strict=True))
    said["group"] = said.pop("permit_group")
    return Permit(**said)


def permit_values(permit: Permit, given_at: str) -> dict[str, object]:
    """Return what is stored of a permit, beside its number."""
    return {
        "plant": permit.plant,
        "person": storable(permit.person),
        "role": storable(permit.role),
        "from_at": permit.from_at,
        "until_at": permit.until_at,
        "permit_group": permit.group,
        "plan": permit.plan,
        "given_by": storable(permit.given_by),
        "given_at": given_at,
    }


def evidence_in(
    database: DatabaseConnection, where: Mapping[str, object]
) -> list[tuple[TipCorrection, ...]]:
    """Return the corrections of each judged cell of some rings, in the order of their ends."""
    return [
        tuple(TipCorrection.from_json(one) for one in json.loads(said))
        for (said,) in database.rows(statements.JUDGED, where)
    ]


def accepted_in(database: DatabaseConnection, plan: str) -> tuple[dict[Key, Accepted], int]:
    """Return what a person has accepted last, and behind which end of a job."""
    rows = database.rows(statements.ACCEPTED, {"plan": plan})
    if not rows:
        return {}, 0
    said, until = rows[0]
    found = {
        (int(tool), str(axis)): Accepted(float(shift), int(cells))
        for tool, axis, shift, cells in json.loads(said)
    }
    return found, int(until)
