"""One write of typed components of a tool: what is kept, what is asked, what is shown."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.backup import keep_first_backup
from robolink.messages import tr
from robolink.model import Controller, ToolOffset, ToolReceipt
from robolink.transaction import Jump, Wanted, change_tools
from robolink_cli.access.warnings import note_change
from robolink_cli.console.render import note, say
from robolink_cli.prompts.jumps import Allowed, accept_jump, allowed_by
from robolink_cli.prompts.questions import agree
from robolink_cli.session.context import CliContext
from robolink_cli.session.ordering import show_done, with_order
from robolink_cli.views.documents import offset_payload, receipt_payload
from robolink_cli.views.tables import show_change

if TYPE_CHECKING:
    from robolink.transaction import Order


class ToolSetting:
    """What ``tool set`` was told.

    Args:
        context: What the command was told.
        number: Number of the tool.
        changes: The components that were typed.
        kept: The names of the others.
        accepted: The largest change that was accepted with the command.
        yes: Whether the question is answered beforehand.

    Raises:
        ConfigError: A component is no number that a tool can have.
    """

    def __init__(
        self,
        context: CliContext,
        number: int,
        changes: Mapping[str, float],
        *,
        kept: Sequence[str],
        accepted: Allowed,
        yes: bool,
    ) -> None:
        # Checks the numbers before a connection is made.
        ToolOffset(**changes)
        self._context, self._number, self._changes = context, number, changes
        self._kept, self._accepted, self._yes = list(kept), accepted, yes

    def preview(self, controller: Controller) -> None:
        """Show what would be sent."""
        _, wanted = self._looked_up(controller)
        self._context.show_requests(controller.tools.preview_write(self._number, wanted))

    def write(self, controller: Controller, order: "Order | None") -> Mapping[str, object]:
        """Ask, write, read back; return the document.

        Raises:
            DeclinedError: The answer was no, or nobody could be asked.
            RobolinkError: As :func:`robolink.transaction.change_tools`.
        """
        number, (before, wanted) = self._number, self._looked_up(controller)
        controller.tools.selected()  # read now: the last line of a failure names it
        if not self._context.json:
            show_change(
                number, offset_payload(before), offset_payload(wanted), after_name=tr("new")
            )
        # An undefined tool has no place from which its tip could jump.
        accepted = before is not None and accept_jump(
            controller,
            number,
            Jump.between(before, wanted),
            allowed=allowed_by(self._context.cell),
            accepted=self._accepted,
        )
        if not (accepted or self._context.json):
            agree(tr("Write this to tool {number}?", number=number), yes=self._yes)
        keep_first_backup(controller, tell=note)
        receipts = change_tools(
            controller,
            [Wanted(number, wanted, before)],
            tell=note,
            order=order,
            describe=self._document,
        )
        return self._document(receipts)

    def show(self, payload: Mapping[str, object], order: "Order | None") -> None:
        """Give the result: of this write, or of the one that the order was carried out with."""
        done = (
            tr("already stored, nothing was written")
            if payload["skipped"]
            else tr("written, read back")
        )

        def tell() -> None:
            if order is not None and order.done is not None:
                show_done(order)
            else:
                say(tr("tool {number}: {done}", number=self._number, done=done))

        self._context.emit("tool-write", with_order(payload, order), tell)

    def _looked_up(self, controller: Controller) -> tuple[ToolOffset | None, ToolOffset]:
        """Return what the tool holds, and what it is to hold."""
        number = self._number
        controller.tools.require_writable(number)
        before = controller.tools.read(number)
        note_change(controller, number, before)
        # Nothing of what no tool has is kept beside what was given.
        kept_from = ToolOffset() if before is None or before.of_no_tool else before
        return before, replace(kept_from, **self._changes)

    def _document(self, receipts: Sequence[ToolReceipt]) -> dict[str, object]:
        (receipt,) = receipts
        return receipt_payload(receipt) | {"kept": self._kept}
