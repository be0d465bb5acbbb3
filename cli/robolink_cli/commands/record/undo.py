"""undo: what tools held before a change is written back."""

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import declared, tr
from robolink_cli.options.consent import dry_run_option, then_select_option, yes_option
from robolink_cli.prompts.questions import agree, on_terminal
from robolink_cli.session.completing import complete_tool
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.opening import open_controller


@click.command()
@click.argument("change", required=False)
@click.option(
    "--tool",
    type=int,
    metavar="N",
    shell_complete=complete_tool,
    help=declared("Only this tool of the change."),
)
@click.option(
    "--to",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help=declared("Bring back the value that this entry of the journal proved."),
)
@then_select_option
@controller_options
@dry_run_option
@yes_option
def undo(
    context: CliContext,
    *,
    change: str | None,
    tool: int | None,
    to: int | None,
    then_select: int | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Put back what tools held before CHANGE; by default before the newest one.

    CHANGE is the beginning of an id, or the number of an entry, as 'robolink journal list'
    shows them. It takes an engineer, is refused when somebody else wrote the tool since, and
    can itself be undone. Nothing moves.
    """
    from robolink.transaction import plan_undo
    from robolink_cli.commands.record.journal_lookup import change_named
    from robolink_cli.commands.record.undo_on_terminal import Undoing

    if change is not None and to is not None:
        raise ConfigError(
            tr("Give CHANGE or --to, not both."),
            remedy=tr("Name a change to undo, or an entry whose value is to come back."),
        )
    job = "" if dry_run else tr("undo a change of a tool")
    with open_controller(context, changes=not dry_run, job=job) as controller:
        chosen = change_named(controller.outcomes.recorded(), change) if change else ""
        plan = plan_undo(controller, tool=tool, change=chosen, to=to)
        undoing = Undoing(controller, plan, then_select=then_select)
        requests = undoing.requests()
        if not context.json:
            undoing.show()
        if dry_run:
            context.show_requests(requests)
            return
        if requests:
            _agree(context, yes=yes)
        payload = undoing.run()
    called = context.cell.name if context.cell else str(context.url)
    context.emit("undo", payload, lambda: undoing.show_end(called))


def _agree(context: CliContext, *, yes: bool) -> None:
    """Ask on a terminal; off it only ``--yes`` is consent.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    if not yes and (context.json or not on_terminal()):
        raise DeclinedError(
            tr("An undo writes to the controller, but there is nobody to ask."),
            remedy=tr("Nothing was written. Look at it with --dry-run, then add --yes."),
        )
    agree(tr("Write the old values back?"), yes=yes)
