"""fleet run: a plan is started, and carried out here where no agent runs."""

from typing import TYPE_CHECKING, Final

import click

from robolink.errors import LeaseHeldError
from robolink.fleet.errors import PlanError
from robolink.messages import listed, tr
from robolink_cli.commands.fleet.agent import Backups, agent_here, ended_by_signals, leave
from robolink_cli.commands.fleet.plant import Operator, PlanId, begun_at_cells, open_plant, who
from robolink_cli.console.exit_codes import DIFFERENT, DONE, UNKNOWN
from robolink_cli.console.render import emit, say
from robolink_cli.options.shared import json_option
from robolink_cli.views.fleet import progress_payload, show_progress

if TYPE_CHECKING:
    from robolink.fleet import FleetStore, PlanProgress

_SHOWN: Final = ("plan", "finished", "states", "halts", "homes")


@click.command("run", short_help="Start a plan; carry it out here if no agent runs.")
@json_option
def run(*, plan: PlanId, backups: Backups = None, operator: Operator = None) -> int:
    """Start PLAN. If an agent of its plant runs, that one carries it out, and this ends at once.

    Otherwise this command is the agent until the plan is finished or waits for a person, a permit,
    its window or the agent of another home, which is named. A plan that moves robots is only
    started: at each cell a person begins its job. Exit code 1 when not every cell did what was
    asked: it ended otherwise or waits, or the plan is halted; 6 when one is unsettled.
    """
    with open_plant() as store:
        found = store.plan(plan)
        holder = ""
        agent = None
        if found.kind.moves:
            start(store, plan, who(operator))
        else:
            with agent_here(found.plant, backups) as agent:
                start(store, plan, who(operator))
                try:
                    with ended_by_signals(agent):
                        agent.run_until_still()
                except LeaseHeldError as error:
                    holder = error.holder
        progress = store.progress(plan)
    emit("fleet-run", _payload(progress, holder), lambda: _show(progress, holder))
    code = DONE if holder else _code(progress)
    return code if agent is None else leave(agent, code)


def start(store: "FleetStore", plan: str, by: str) -> None:
    """Start a plan that was not started yet.

    Raises:
        PlanError: It was halted before: whoever lifts that gives a reason.
    """
    standing = store.progress(plan).standing
    first = next((halt for halt in standing if halt.before_the_start), None)
    if first is None:
        return
    others = [halt.sentence for halt in standing if halt is not first]
    if others:
        raise PlanError(
            listed(tr("Plan {plan} is halted:", plan=plan), others),
            remedy=tr(
                "Nothing was started. To go on: robolink fleet resume {plan} --reason WHY",
                plan=plan,
            ),
        )
    store.resume(plan, by, tr("started"), seen=first)


def _payload(progress: "PlanProgress", holder: str) -> dict[str, object]:
    """Return which other process carries the plan out, if one does, and how the plan stands."""
    said = progress_payload(progress)
    return {"agent": holder or None} | {key: said[key] for key in _SHOWN}


def _show(progress: "PlanProgress", holder: str) -> None:
    show_progress(progress)
    if progress.plan.kind.moves and not progress.finished:
        say(begun_at_cells(progress.plan.id))
    if holder:
        say(tr("{who} carries it out.", who=holder))


def _code(progress: "PlanProgress") -> int:
    from robolink.fleet import JobState

    counts = progress.counts()
    if counts[JobState.UNSETTLED]:
        return UNKNOWN
    others = [state for state in counts if state.final and not state.answered]
    return DIFFERENT if others or progress.standing or not progress.finished else DONE
