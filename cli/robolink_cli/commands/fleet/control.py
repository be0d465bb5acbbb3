"""fleet halt, resume: a person holds a plan back, or lets it go on."""

from typing import TYPE_CHECKING, Annotated

import click

from robolink.messages import tr
from robolink_cli.commands.fleet.plant import Operator, PlanId, no_agent, open_plant, who
from robolink_cli.console.render import emit, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.views.fleet import halt_payload

if TYPE_CHECKING:
    from robolink.fleet import Halt


@click.command("halt", short_help="Halt a plan; what runs comes to its end.")
@json_option
def halt(
    *,
    plan: PlanId,
    reason: Annotated[
        str | None, LINE, CliOption(metavar="WHY", help="Why, for the record.")
    ] = None,
    cancel: Annotated[bool, CliOption(help="For good: the jobs that wait are cancelled.")] = False,
    operator: Operator = None,
) -> None:
    """Halt PLAN: no further job of it begins. What runs at a cell comes to its end.

    It stops no robot: 'robolink stop' does.
    """
    with open_plant() as store:
        cancelled = store.cancel(plan, who(operator), reason or "") if cancel else 0
        standing = store.halt(plan, who(operator), reason or "")
    payload = {"plan": plan, "cancelled_count": cancelled, "halt": halt_payload(standing)}
    emit("fleet-halted", payload, lambda: _show_halted(plan, standing, cancelled, for_good=cancel))


def _show_halted(plan: str, standing: "Halt", cancelled: int, *, for_good: bool) -> None:
    say(tr("Plan {plan} is halted: {why}", plan=plan, why=standing.sentence))
    if for_good:
        say(tr("Cancelled jobs: {count}", count=cancelled))
    else:
        say(tr("To go on: robolink fleet resume {plan} --reason WHY", plan=plan))


@click.command("resume", short_help="Let a halted plan, or its next ring, go on.")
@json_option
def resume(
    *,
    plan: PlanId,
    reason: Annotated[str, LINE, CliOption(metavar="WHY", help="Why that is right.")],
    operator: Operator = None,
) -> None:
    """Let PLAN go on after a halt, or with its next ring after a pause.

    Cells that ended refused or missed are not begun again. One that is unsettled is: run 'robolink
    recover' there first. If the plan was halted because the corrections of many cells moved alike,
    that shift is accepted.
    """
    with open_plant() as store:
        lifted = store.resume(plan, who(operator), reason)
        moves = store.plan(plan).kind.moves
    payload = {"plan": plan, "lifted": [halt_payload(one) for one in lifted]}

    def show() -> None:
        for one in lifted:
            say(tr("Lifted: {why}", why=one.sentence))
        say(tr("Plan {plan} goes on.", plan=plan))
        if moves:
            say(no_agent())

    emit("fleet-resumed", payload, show)
