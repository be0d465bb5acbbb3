"""backup, restore, compare: the tools of a controller and a file."""

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import click

from robolink.backup import RestorePlan, keep_first_backup
from robolink.backup import restore as restore_tools
from robolink.messages import tr
from robolink.model import Controller, ToolReceipt, require_engineer
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import note, say
from robolink_cli.options.consent import DryRun, Overwrite, Published, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import AcceptedAngle, AcceptedLength, accepted_jump, agree
from robolink_cli.session.completing import complete_tool
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.opening import open_controller
from robolink_cli.views.documents import receipt_payload
from robolink_cli.views.tables import show_change

_FILE = click.Path(dir_okay=False, path_type=Path)


@click.command()
@controller_options
def backup(
    context: CliContext,
    *,
    file: Annotated[Path, _FILE, CliArgument()],
    force: Overwrite = False,
) -> None:
    """Save all fifteen tools, the one that is selected, and which controller it is. Reads only."""
    from robolink.backup import save, take_backup
    from robolink.files.named import require_free
    from robolink_cli.views.backup import backup_payload, show_backup

    require_free(file, replace=force)
    with open_controller(context) as controller:
        taken = take_backup(controller)
    save(taken, file, replace=force)
    context.emit("backup-saved", backup_payload(taken, file), lambda: show_backup(taken, file))


@click.command()
@controller_options
def compare(
    context: CliContext,
    *,
    file: Annotated[Path, _FILE, CliArgument()],
    length_mm: Annotated[
        float,
        NumberInside(min=0),
        CliOption("--tolerance", help="Largest difference of X, Y, Z that counts as none."),
    ] = 0.0005,
    angle_deg: Annotated[
        float,
        NumberInside(min=0),
        CliOption("--tolerance-deg", help="Largest difference of U, V, W that counts as none."),
    ] = 0.0005,
    ignore_selected: Annotated[
        bool,
        CliOption(
            help="Show another selected tool, but do not count it: a program selects tools by "
            "itself."
        ),
    ] = False,
    published: Published = False,
) -> int:
    """Show what differs from a backup. Exit code 1 when something does. Reads only.

    The file may be of another controller: one good file can be compared with many cells.
    """
    from robolink.backup import ComparisonTolerance, load
    from robolink.backup import compare as compare_tools
    from robolink_cli.session.context import find_tools
    from robolink_cli.views.backup import comparison_payload, show_comparison

    expected, tolerance = load(file), ComparisonTolerance(length_mm, angle_deg)
    with open_controller(context) as controller:
        found = find_tools(controller, published=published)
        identity = controller.identity
    comparison = compare_tools(
        expected.state, found, tolerance, selection_counts=not ignore_selected
    )
    payload: dict[str, object] = {
        "controller": identity,
        "file": str(file),
        "source": "published" if published else "controller",
        **comparison_payload(comparison, tolerance),
    }
    context.emit("compare", payload, lambda: show_comparison(comparison, tolerance, identity))
    return 0 if comparison.equal else DIFFERENT


@click.command()
@controller_options
def restore(
    context: CliContext,
    *,
    file: Annotated[Path, _FILE, CliArgument()],
    tools: Annotated[
        tuple[int, ...],
        CliOption("--tool", shell_complete=complete_tool, help="Only this tool; may be repeated."),
    ] = (),
    selected: Annotated[bool, CliOption(help="Also select the backup's tool.")] = False,
    other_controller: Annotated[
        bool, CliOption(help="The backup is of another controller and is still meant for this one.")
    ] = False,
    accepted_mm: AcceptedLength = None,
    accepted_deg: AcceptedAngle = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Write the tools of a backup that differ, each only if nobody changed it meanwhile.

    A tool that is undefined in the backup is cleared. Nothing else is changed. A change beyond
    the cell's max_change_mm or max_change_deg is asked about, even with --yes.
    """
    from robolink.backup import load, plan_restore, read_tools, require_same_controller
    from robolink_cli.commands.controller.backup import Restoration

    wanted = load(file)
    with open_controller(context, changes=not dry_run) as controller:
        if not other_controller:
            require_same_controller(wanted, controller.identity, controller.facts())
        plan = plan_restore(wanted, read_tools(controller), tools=tools, selected=selected)
        restoration = Restoration(controller, plan)
        requests = restoration.requests()
        if dry_run:
            context.show_requests(requests)
            return
        if not plan.empty:
            if not context.json:
                restoration.show()
            agree(
                tr("Write these values to the controller? 'robolink undo' takes them back."),
                yes=yes,
                asks=not context.json,
            )
        payload = restoration.run(accepted_mm=accepted_mm, accepted_deg=accepted_deg)
    context.emit("restore", {"file": str(file), **payload}, restoration.show_end)


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
            show_change(change.tool, change.now, change.wanted, after_name=tr("backup"))
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
