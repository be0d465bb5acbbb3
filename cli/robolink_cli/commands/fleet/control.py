"""fleet halt, resume: a person holds a plan back, or lets it go on."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import click

from robolink.messages import listed, tr
from robolink_cli.commands.fleet.plant import Operator, PlanId, begun_at_cells, open_plant, who
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on, note, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.prompts.questions import require_yes
from robolink_cli.views.fleet import halt_payload, halts_in_words

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
    last: Annotated[
        int | None,
        CliOption(
            "--halt",
            metavar="N",
            help="The last halt that you saw, by its number in 'robolink fleet status': later ones "
            "stay. Needed where several stand and nobody can be asked.",
        ),
    ] = None,
    operator: Operator = None,
) -> None:
    """Let PLAN go on after a halt, or with its next ring after a pause.

    It lifts the halts that it shows and no other: one that comes meanwhile stays. Where several
    stand it asks first on a terminal, and needs --halt elsewhere.

    Cells that ended refused or missed are not begun again. One that is unsettled is: run 'robolink
    recover' there first. If the plan was halted because the corrections of many cells moved alike,
    that shift is accepted.
    """
    with open_plant() as store:
        seen = _seen(plan, store.progress(plan).standing, last)
        lifted = store.resume(plan, who(operator), reason, seen=seen)
        left = store.progress(plan).standing
        moves = store.plan(plan).kind.moves
    payload = {
        "plan": plan,
        "lifted": [halt_payload(one) for one in lifted],
        "halts": [halt_payload(one) for one in left],
    }

    def show() -> None:
        for one in lifted:
            say(tr("Lifted: {why}", why=one.sentence))
        if left:
            say(listed(tr("Plan {plan} is halted still:", plan=plan), halts_in_words(left)))
            return
        say(tr("Plan {plan} goes on.", plan=plan))
        if moves:
            say(begun_at_cells(plan))

    emit("fleet-resumed", payload, show)


def _seen(plan: str, standing: "Sequence[Halt]", last: int | None) -> "Halt":
    """Return the last halt that the person has seen.

    Args:
        plan: Id of the plan.
        standing: The halts that nobody has lifted, oldest first.
        last: The number that was given; ``None`` for none.

    Raises:
        PlanError: No halt of that number stands, or several stand and nobody can be asked.
        DeclinedError: The answer was no.
    """
    from robolink.fleet import Halt, HaltRule, PlanError

    if last is not None:
        for one in standing:
            if one.number == last:
                return one
        shown = halts_in_words(standing)
        raise PlanError(
            listed(
                tr("Plan {plan} has no halt {number} that stands.", plan=plan, number=last), shown
            ),
            remedy=tr("Nothing was changed. Look again: robolink fleet status {plan}", plan=plan),
        )
    if not standing:
        return Halt(plan, 0, "", HaltRule.PERSON)  # before the first: none that comes now is lifted
    if len(standing) > 1:
        found = listed(tr("Halts of plan {plan}:", plan=plan), halts_in_words(standing))
        if json_is_on() or not person_here():
            raise PlanError(
                found,
                remedy=tr(
                    "Nothing was changed. Name the last one that you saw: --halt {number}",
                    number=standing[-1].number,
                ),
            )
        note(found)
        require_yes(tr("Lift all {count}?", count=len(standing)))
    return standing[-1]
