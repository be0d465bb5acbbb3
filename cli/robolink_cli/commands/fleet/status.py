"""fleet status: how plans stand, and what each job waits for."""

from typing import TYPE_CHECKING, Annotated

import click

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_cli.commands.fleet.plant import AnyPlanId, open_plant
from robolink_cli.console.render import emit
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.views.fleet import (
    cells_payload,
    job_payload,
    plans_payload,
    progress_payload,
    show_cells,
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
    order: Annotated[
        str | None,
        CliOption(metavar="ID", help="Show the job that a line computer ordered under this id."),
    ] = None,
    cells: Annotated[
        str | None,
        LINE,
        CliOption(
            metavar="PLANT",
            help="Show the cells of a plant instead: which recipe each runs, since when, what is "
            "unfinished, its last check.",
        ),
    ] = None,
) -> None:
    """Show all plans, newest first, and homes, or how PLAN stands, ring by ring.

    A job that a person began at a cell of this computer, and whose end is on record there but not
    in the plant's database yet, is reported first.
    """
    if order is not None:
        if plan is not None or why is not None or cells is not None:
            raise ConfigError(
                tr("--order finds its plan and its cell itself."),
                remedy=tr("Leave the others out: robolink fleet status --order ID"),
            )
        _show_ordered(order)
        return
    if cells is not None:
        _show_cells(cells)
        return
    if why is not None and plan is None:
        raise ConfigError(
            tr("--why needs the plan, too."),
            remedy=tr("Write for example: robolink fleet status PLAN --why CELL"),
        )
    if plan is None:
        with open_plant(missing_ok=True) as store:
            overviews = store.overviews() if store.made else ()
            homes = store.homes() if store.made else ()
        payload = plans_payload(overviews, homes)
        emit("fleet-plans", payload, lambda: show_plans(overviews, homes))
        return
    from robolink_cli.session.cell_plans import report_all_from_record

    with open_plant() as store:
        progress = report_all_from_record(store, store.progress(plan))
    if why is None:
        emit("fleet-status", progress_payload(progress), lambda: show_progress(progress))
        return
    job = _job_of(progress, why)
    emit("fleet-job", job_payload(progress, job), lambda: show_job(progress, job))


def _show_ordered(order: str) -> None:
    """Show the job of a line computer's order; where several used that id, the newest."""
    with open_plant() as store:
        jobs = store.line_jobs(order)
        if not jobs:
            raise ConfigError(
                tr("No line computer ordered {order}.", order=repr(order[:65])),
                remedy=tr("'robolink fleet status' lists the plans; such orders are their names."),
            )
        progress = store.progress(jobs[-1].plan)
    (job,) = progress.jobs
    emit("fleet-job", job_payload(progress, job), lambda: show_job(progress, job))


def _show_cells(plant: str) -> None:
    from robolink.fleet import PlantNotes, default_plant

    with PlantNotes(default_plant(), plant) as notes:
        cells = notes.cells() if notes.made else {}
    emit("fleet-cells", cells_payload(plant, cells), lambda: show_cells(cells))


def _job_of(progress: "PlanProgress", cell: str) -> "CellJob":
    for job in progress.jobs:
        if job.cell == cell:
            return job
    raise ConfigError(
        tr("Plan {plan} has no cell {cell}.", plan=progress.plan.id, cell=cell),
        remedy=known_names(progress.plan.cells, cell),
    )
