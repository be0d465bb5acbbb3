"""fleet status: how plans stand, and what each job waits for."""

from typing import TYPE_CHECKING, Annotated

import click

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_cli.commands.fleet.plant import AnyPlanId, open_plant
from robolink_cli.console.render import emit
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.views.fleet import (
    job_payload,
    plans_payload,
    progress_payload,
    show_job,
    show_plans,
    show_progress,
)

if TYPE_CHECKING:
    from robolink.fleet import CellJob, PlanProgress


@click.command("status", short_help="Show how plans stand, and what each job waits for.")
@json_option
def status(
    *,
    plan: AnyPlanId = None,
    why: Annotated[
        str | None,
        CliOption(metavar="CELL", help="Show the job of this cell alone, and why it waits."),
    ] = None,
) -> None:
    """Show all plans, newest first, or how PLAN stands, ring by ring."""
    if why is not None and plan is None:
        raise ConfigError(
            tr("--why needs the plan, too."),
            remedy=tr("Write for example: robolink fleet status PLAN --why CELL"),
        )
    if plan is None:
        with open_plant(missing_ok=True) as store:
            overviews = store.overviews() if store.made else ()
        emit("fleet-plans", plans_payload(overviews), lambda: show_plans(overviews))
        return
    with open_plant() as store:
        progress = store.progress(plan)
    if why is None:
        emit("fleet-status", progress_payload(progress), lambda: show_progress(progress))
        return
    job = _job_of(progress, why)
    emit("fleet-job", job_payload(progress, job), lambda: show_job(progress, job))


def _job_of(progress: "PlanProgress", cell: str) -> "CellJob":
    for job in progress.jobs:
        if job.cell == cell:
            return job
    raise ConfigError(
        tr("Plan {plan} has no cell {cell}.", plan=progress.plan.id, cell=cell),
        remedy=known_names(progress.plan.cells, cell),
    )
