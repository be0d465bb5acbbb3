"""A restore on a terminal: what is shown, sent and reported."""

from contextlib import ExitStack

from robolink.backup import RestorePlan, keep_first_backup
from robolink.backup import restore as restore_tools
from robolink.messages import tr
from robolink.model import Controller, ToolReceipt, require_engineer
from robolink_cli.console.render import note, say
from robolink_cli.prompts.jumps import accepted_jump
from robolink_cli.views.documents import offset_payload, receipt_payload
from robolink_cli.views.tables import show_change


class Restoration:
    """One restore of one controller."""

    def __init__(self, controller: Controller, plan: RestorePlan) -> None:
        self._controller = controller
        self._plan = plan

    def requests(self) -> list[str]:
        """Return what would be sent besides reads; finds what the controller cannot hold.

        Raises:
            ToolError: A value does not fit this robot.
            NotReadyError: The state forbids a write.
        """
        plan, tools = self._plan, self._controller.tools
        requests: list[str] = []
        for change in plan.writes:
            if change.wanted is not None:
                requests += tools.preview_write(change.tool, change.wanted)
        if plan.select is not None:
            requests += tools.preview_select(plan.select)
        for change in plan.clears:
            # The selection in place of it stands there already.
            clear = tools.preview_clear(change.tool, then_select=plan.select)
            requests += [request for request in clear if request not in requests]
        return requests

    def show(self) -> None:
        """Show what would change."""
        for change in self._plan.changes:
            show_change(
                change.tool,
                offset_payload(change.now),
                offset_payload(change.wanted),
                after_name=tr("backup"),
            )
        if self._plan.select is not None:
            say(tr("tool {tool} will be selected", tool=self._plan.select))

    def run(self, *, accepted_mm: float | None, accepted_deg: float | None) -> dict[str, object]:
        """Carry it out and return the document; nothing is sent when nothing differs.

        Args:
            accepted_mm: The length of a jump that was accepted beforehand.
            accepted_deg: The angle of a jump that was accepted beforehand.
        """
        receipts: tuple[ToolReceipt, ...] = ()
        if not self._plan.empty:
            require_engineer(self._controller.outcomes, tr("restore tools from a backup"))
            with ExitStack() as accepted:
                for change in self._plan.changes:
                    jump = self._controller.change_guard.beyond(change.now, change.wanted)
                    if jump is not None:
                        accepted.enter_context(
                            accepted_jump(
                                self._controller,
                                change.tool,
                                jump,
                                accepted_mm=accepted_mm,
                                accepted_deg=accepted_deg,
                            )
                        )
                keep_first_backup(self._controller, tell=note)
                receipts = restore_tools(self._controller.tools, self._plan, tell=note)
        return {
            "restored": [receipt_payload(receipt) for receipt in receipts],
            "selected_tool": self._controller.tools.selected(),
        }

    def show_end(self) -> None:
        """Say how it ended."""
        if self._plan.empty:
            say(tr("The controller has these values already. Nothing was written."))
        elif self._plan.changes:
            numbers = ", ".join(str(change.tool) for change in self._plan.changes)
            say(tr("Tools restored and read back: {numbers}.", numbers=numbers))
