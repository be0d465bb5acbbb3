"""undo: writes back what tools held before a change."""

from collections.abc import Sequence
from typing import Annotated

import click

from robolink.backup import keep_first_backup
from robolink.errors import ConfigError, DeclinedError
from robolink.messages import tr
from robolink.model import Controller, ToolReceipt
from robolink.transaction import Order, Undone, UndoPlan
from robolink.transaction import undo as take_back
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on, note, say, show_requests
from robolink_cli.options.consent import DryRun, ThenSelect, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import agree
from robolink_cli.session.completion import complete_tool
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.order import (
    OrderId,
    ordered,
    require_no_dry_run,
    show_done,
    with_order,
)
from robolink_cli.views.documents import receipt_payload, show_change


@click.command()
@controller_options
def undo(
    context: CliContext,
    *,
    change: Annotated[str | None, CliArgument()] = None,
    tool: Annotated[
        int | None, CliOption(shell_complete=complete_tool, help="Only this tool of the change.")
    ] = None,
    to: Annotated[
        int | None,
        click.IntRange(min=1),
        CliOption(metavar="NUMBER", help="Write back the value that this journal entry confirms."),
    ] = None,
    then_select: ThenSelect = None,
    order: OrderId = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Undo CHANGE: write back what the tools held before it; default: the newest change.

    CHANGE is the beginning of an id, or the number of an entry, as 'robolink journal list'
    shows them. Needs an engineer, is refused when somebody else wrote the tool since, and can
    itself be undone. Moves nothing.
    """
    require_no_dry_run(order, dry_run=dry_run)
    if change is not None and to is not None:
        raise ConfigError(
            tr("Give CHANGE or --to, not both."),
            remedy=tr("Name a change to undo, or an entry whose value to write back."),
        )
    job = "" if dry_run else tr("undo a change of a tool")
    with (
        open_controller(context, changes=not dry_run, job=job) as controller,
        # Looked up before the plan: the newest change is another one once this is carried out.
        ordered(controller, order, "undo") as found,
    ):
        if found is not None and found.done is not None:
            done = found
            emit("undo", with_order(found.done.result, found), lambda: show_done(done))
            return
        undoing = Undoing(
            controller,
            _planned(controller, change, tool=tool, to=to),
            then_select=then_select,
            order=found,
        )
        requests = undoing.requests()
        if not json_is_on():
            undoing.show()
        if dry_run:
            show_requests(requests)
            return
        if requests:
            _agree(yes=yes)
        payload = undoing.run()
    called = context.cell.name if context.cell else str(context.url)
    emit("undo", with_order(payload, found), lambda: undoing.show_end(called))


def _planned(
    controller: Controller, change: str | None, *, tool: int | None, to: int | None
) -> UndoPlan:
    from robolink.transaction import plan_undo
    from robolink_cli.commands.record.journal_lookup import change_named

    chosen = change_named(controller.outcomes.recorded(), change) if change else ""
    return plan_undo(controller, tool=tool, change=chosen, to=to)


def _agree(*, yes: bool) -> None:
    """Ask on a terminal; off it only ``--yes`` is consent.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    if not yes and (json_is_on() or not person_here()):
        raise DeclinedError(
            tr("An undo writes to the controller, but there is nobody to ask."),
            remedy=tr("Nothing was written. Look at it with --dry-run, then add --yes."),
        )
    agree(tr("Write the old values back?"), yes=yes)


class Undoing:
    """One undo on one controller.

    Args:
        controller: The controller, connected.
        plan: What to do.
        then_select: The tool to select in place of one that becomes undefined.
        order: The order that it carries out.
    """

    def __init__(
        self,
        controller: Controller,
        plan: UndoPlan,
        *,
        then_select: int | None = None,
        order: Order | None = None,
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._then_select = then_select
        self._order = order
        self._done = Undone("", ())

    def requests(self) -> list[str]:
        """Return what would be sent besides reads.

        Raises:
            ToolError: A value does not fit this robot, or the selected tool would become
                undefined.
            NotReadyError: The state forbids a write.
        """
        tools = self._controller.tools
        requests: list[str] = []
        for step in self._plan.steps:
            if step.requested is None:
                requests += tools.preview_clear(step.tool, then_select=self._then_select)
            else:
                requests += tools.preview_write(step.tool, step.requested)
        return requests

    def show(self) -> None:
        """Show what would change."""
        say(self._plan.sentence)
        for remark in self._plan.remarks:
            say(f"  {remark}")
        for step in self._plan.steps:
            show_change(step.tool, step.before, step.requested, after_name=tr("restored"))

    def run(self) -> dict[str, object]:
        """Carry it out and return the document; nothing is sent when nothing differs."""
        if self._plan.steps:
            keep_first_backup(self._controller, tell=note)
        self._done = take_back(
            self._controller,
            self._plan,
            then_select=self._then_select,
            tell=note,
            order=self._order,
            describe=lambda receipts: self._document(self._controller.outcomes.change, receipts),
        )
        return self._document(self._done.change, self._done.receipts)

    def _document(self, change: str, receipts: Sequence[ToolReceipt]) -> dict[str, object]:
        return {
            "sentence": self._plan.sentence,
            "remarks": list(self._plan.remarks),
            **self._plan.details,
            "change": change or None,
            "unchanged": list(self._plan.unchanged),
            "restored": [receipt_payload(receipt) for receipt in receipts],
        }

    def show_end(self, cell: str) -> None:
        """Show how it ended, and how to undo it.

        Args:
            cell: How a person names the controller.
        """
        if not self._done.receipts:
            say(tr("The controller has the old values already. Nothing was written."))
            return
        numbers = ", ".join(str(receipt.tool) for receipt in self._done.receipts)
        say(tr("Old values written and read back: tool {numbers}.", numbers=numbers))
        say(
            tr(
                'To undo it: robolink -c "{cell}" undo {id}',
                cell=cell,
                id=self._done.change[:8],
            )
        )
