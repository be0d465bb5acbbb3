"""An undo on a terminal: what is shown, sent and reported."""

from robolink.backup import keep_first_backup
from robolink.messages import tr
from robolink.model import Controller
from robolink.transaction import Undone, UndoPlan, undo
from robolink_cli.console.render import note, say
from robolink_cli.views.documents import offset_payload, receipt_payload
from robolink_cli.views.tables import show_change


class Undoing:
    """One undo on one controller.

    Args:
        controller: The controller, connected.
        plan: What to do.
        then_select: The tool to put in force in place of one that becomes undefined.
    """

    def __init__(
        self, controller: Controller, plan: UndoPlan, *, then_select: int | None = None
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._then_select = then_select
        self._done = Undone("", ())

    def requests(self) -> list[str]:
        """Return what would be sent besides reads.

        Raises:
            ToolError: A value does not fit this robot, or the tool in force would become
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
            shown = offset_payload(step.before), offset_payload(step.requested)
            show_change(step.tool, *shown, after_name=tr("restored"))

    def run(self) -> dict[str, object]:
        """Carry it out and return the document; nothing is sent when nothing differs."""
        if self._plan.steps:
            keep_first_backup(self._controller, tell=note)
            self._done = undo(
                self._controller, self._plan, then_select=self._then_select, tell=note
            )
        return {
            "sentence": self._plan.sentence,
            "remarks": list(self._plan.remarks),
            **self._plan.details,
            "change": self._done.change or None,
            "unchanged": list(self._plan.unchanged),
            "restored": [receipt_payload(receipt) for receipt in self._done.receipts],
        }

    def show_end(self, cell: str) -> None:
        """Say how it ended, and how it is undone.

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
                'To take it back: robolink -c "{cell}" undo {id}',
                cell=cell,
                id=self._done.change[:8],
            )
        )
