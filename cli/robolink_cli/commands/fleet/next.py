"""fleet next: a person at a cell carries out the job that a plan has for it."""

from typing import TYPE_CHECKING, Annotated, NamedTuple

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import tr
from robolink_cli.commands.fleet.plant import AnyPlanId, open_plant
from robolink_cli.console.exit_codes import DIFFERENT, DONE
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, say
from robolink_cli.options.consent import Plain
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE
from robolink_cli.session.context import CliContext, controller_options, guided_if_alone
from robolink_cli.session.operator_identity import Lot, Nozzle

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.fleet import CellJob, FleetStore
    from robolink.recipe import LoadedRecipe
    from robolink_cli.session.cell_plans import PlannedJob


class _Wanted(NamedTuple):
    """What was typed.

    Attributes:
        plan: Id of the plan; ``None`` for whichever has a job that is due.
        plant: Id of the plant.
        nozzle: Id of the nozzle that is mounted.
        lot: Its lot.
        assist: A simulator's stand-in for the person who jogs.
    """

    plan: str | None
    plant: str
    nozzle: str | None
    lot: str | None
    assist: str | None


@click.command("next", short_help="Carry out the job that a plan has for this cell.")
@controller_options
def next_job(
    context: CliContext,
    *,
    plan: AnyPlanId = None,
    plant: Annotated[str, LINE, CliOption(metavar="NAME", help="The plant.")] = "plant",
    nozzle: Nozzle = None,
    lot: Lot = None,
    assist: Annotated[
        str | None,
        CliOption(
            metavar="URL",
            help="A simulator's assist or sim URL: its simulated operator jogs the tip "
            "onto the pin.",
        ),
    ] = None,
    _plain: Plain = False,
) -> int:
    """Carry out the job of PLAN at this cell: the change by the plan's recipe.

    Without PLAN it takes the oldest plan with a job here, or shows what the others wait for. A
    person at the cell has to agree after the job was shown; no option does it in advance. A no
    before anything began leaves the job waiting. The exit code is that of the change; 1 when no
    job is due here. One that was interrupted is delivered again, and carried out once.
    """
    cell = _cell_of(context)
    wanted = _Wanted(plan, plant, nozzle, lot, assist)
    with open_plant() as store:
        if plan is not None:
            _require_person(store, plan, plant, cell)
        if _due(store, cell, wanted) is None:
            code, payload = DIFFERENT, _nothing(store, cell, wanted)
        else:
            code, payload = guided_if_alone(
                context,
                lambda: _carried_out(context, store, cell, wanted),
                job=tr("Change needle"),
                alone=assist is None,
            )
    emit("fleet-next", payload, lambda: None)
    return code


def _cell_of(context: CliContext) -> "Cell":
    """Return the cell, whose home this computer is.

    Raises:
        ConfigError: An address was named, or the home is another computer.
    """
    if context.cell is None:
        raise ConfigError(
            tr("Plans are for cells of the cell file, not for an address."),
            remedy=tr("Name the cell: robolink -c CELL fleet next"),
        )
    context.cell.home.require_here()
    return context.cell


def _require_person(store: "FleetStore", plan: str, plant: str, cell: "Cell") -> None:
    """Refuse a plan that has no job for a person here.

    Raises:
        PlanError: There is no such plan, it is another plant's, it has no such cell, or nobody
            has to agree to it.
    """
    from robolink.fleet import PlanError
    from robolink.messages import known_names

    found = store.plan(plan)
    if found.plant != plant:
        raise PlanError(
            tr("Plan {plan} is not of plant {plant}.", plan=plan, plant=plant),
            remedy=tr(
                "Nothing was begun. If this cell is of plant {plant}, add --plant {plant}.",
                plant=found.plant,
            ),
        )
    if cell.name not in found.cells:
        raise PlanError(
            tr("Plan {plan} has no cell {cell}.", plan=plan, cell=cell.name),
            remedy=known_names(found.cells, cell.name),
        )
    if not found.kind.moves:
        raise PlanError(
            tr("Plan {plan} ({kind}) needs no person at a cell.", plan=plan, kind=found.kind),
            remedy=tr("An agent carries it out: robolink fleet run {plan}", plan=plan),
        )


def _due(store: "FleetStore", cell: "Cell", wanted: _Wanted) -> "PlannedJob | None":
    from robolink_cli.session.cell_plans import jobs_at

    jobs = jobs_at(store, wanted.plant, cell.name)
    return next((one for one in jobs if one.is_due and wanted.plan in (None, one.plan.id)), None)


def _nothing(store: "FleetStore", cell: "Cell", wanted: _Wanted) -> dict[str, object]:
    """Show, plan by plan, why no job is due; return the document."""
    from robolink.fleet import state_in_words, wait_in_words
    from robolink_cli.session.cell_plans import jobs_at

    plan, jobs = wanted.plan, jobs_at(store, wanted.plant, cell.name)
    waiting = [one for one in jobs if plan in (None, one.plan.id)]
    for one in waiting:
        assert one.why is not None  # noqa: S101 - one that was begun is due
        say(
            tr(
                "Plan {plan} ({name}) waits here for: {why}",
                plan=one.plan.id,
                name=one.plan.name,
                why=wait_in_words(one.why),
            )
        )
    if not waiting and plan is not None:
        job = next(one for one in store.progress(plan).jobs if one.cell == cell.name)
        say(
            tr(
                "The job of plan {plan} has ended here: {state}",
                plan=plan,
                state=state_in_words(job.state),
            )
        )
    elif not waiting:
        say(tr("No plan has a job for a person here."))
    told = [
        {"plan": one.plan.id, "name": one.plan.name, "kind": str(one.plan.kind), "why": one.why}
        for one in waiting
    ]
    return {"cell": cell.name, "job": None, "waiting": told}


def _carried_out(
    context: CliContext, store: "FleetStore", cell: "Cell", wanted: _Wanted
) -> tuple[int, dict[str, object]]:
    """Carry out the job that is due; return the exit code, and the document.

    Raises:
        RobolinkError: It ended early, or nothing was begun.
    """
    from robolink.recipe import Answers
    from robolink_cli.commands.fleet.job_gate import JobGate
    from robolink_cli.commands.measure.recalibration import Recalibration, RunOptions
    from robolink_cli.commands.measure.run_events import EventStream
    from robolink_cli.session.cell_plans import recipe_here, report_from_record

    planned = _due(store, cell, wanted)
    if planned is None:  # it was, before the screen was drawn
        return DIFFERENT, _nothing(store, cell, wanted)
    before = report_from_record(store, planned.plan, cell)
    if before is not None:
        return before.job.code or DONE, _told(planned, before.job)
    loaded = recipe_here(planned.plan, cell)
    if planned.why is not None or planned.may_write:
        _agree(context, planned, loaded)
    person = planned.permit.person if planned.permit is not None else None
    gate = JobGate(store, planned)
    run = Recalibration(
        context._replace(operator=context.operator or person),
        loaded,
        RunOptions(
            Answers(nozzle=wanted.nozzle or "", lot=wanted.lot or ""),
            assist_url=wanted.assist,
            gate=gate,
        ),
        EventStream(click.get_current_context(), on=False),
    )
    try:
        run.carry_out()
    except BaseException as error:
        gate.end(error)  # its state is told there, before the error
        raise
    ended = gate.end()
    return DONE, _document(planned, ended.job if ended is not None else None)


def _agree(context: CliContext, planned: "PlannedJob", loaded: "LoadedRecipe") -> None:
    """Show the job, and let the person at the cell agree to it.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    from robolink_cli.commands.measure.recalibrate import steps_of
    from robolink_cli.prompts.current_desk import current_desk
    from robolink_cli.prompts.questions import require_yes
    from robolink_cli.session.context import header_of

    desk = current_desk()
    if desk is not None:
        from robolink_cli.wizard.state import ChoiceSubject, choose_in_either_language

        def ask() -> tuple[str, ChoiceSubject]:
            head = header_of(context, tr("Change needle"), steps=steps_of(loaded))
            desk.regard(head)
            row = tr("Plan {name}", name=planned.plan.name)
            details = (*planned.told(), *_tools(loaded), _before(planned, loaded))
            subject = ChoiceSubject(
                tr("Choose"), (), (row,), details=(details,), does=tr("Begin"), enters=False
            )
            return tr("Carry out this job now?"), subject

        choose_in_either_language(desk, ask, lambda: None)
        return
    for line in (*planned.told(), *_tools(loaded), _before(planned, loaded)):
        say(line)
    if not person_here():
        raise DeclinedError(
            tr("A person at the cell has to agree to this job, but there is nobody to ask."),
            remedy=tr(
                "Nothing was begun. Run it on a terminal at the cell, or begin it on the panel."
            ),
        )
    require_yes(tr("Carry out this job now?"))


def _tools(loaded: "LoadedRecipe") -> tuple[str, ...]:
    return tuple(
        tr("tool {number}: {name}", number=one.number, name=one.name)
        if one.name
        else tr("tool {number}", number=one.number)
        for one in loaded.recipe.tools
    )


def _before(planned: "PlannedJob", loaded: "LoadedRecipe") -> str:
    """Return what has to be done before it begins."""
    from robolink.fleet import PlanKind

    numbers = ", ".join(str(one.number) for one in loaded.recipe.tools)
    if planned.plan.kind is PlanKind.NOZZLE_CHANGE:
        return tr("First mount the new nozzle of tool {tools}.", tools=numbers)
    return tr("It measures tool {tools} with what is mounted now.", tools=numbers)


def _told(planned: "PlannedJob", job: "CellJob") -> dict[str, object]:
    """Show that a job had ended before; return the document."""
    from robolink_cli.commands.fleet.job_gate import tell_state

    tell_state(job)
    return _document(planned, job)


def _document(planned: "PlannedJob", job: "CellJob | None") -> dict[str, object]:
    plan = planned.plan
    return {
        "cell": planned.job.cell,
        "job": {
            "plan": plan.id,
            "order": planned.job.order,
            "kind": str(plan.kind),
            "ring": planned.job.ring + 1,
            "recipe_hash": plan.recipe_hash,
            "permit": None if planned.permit is None else planned.permit.person,
            "state": None if job is None else str(job.state),
            "exit_code": None if job is None else job.code,
            "change": (job.change or None) if job is not None else None,
            "what": (job.what or None) if job is not None else None,
        },
        "waiting": [],
    }
