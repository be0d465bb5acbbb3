"""backup, restore, compare: the tools of a controller and a file."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import click

from robolink.backup import (
    Backup,
    Comparison,
    ComparisonTolerance,
    RestoreChange,
    RestorePlan,
    ToolComparison,
    keep_first_backup,
)
from robolink.messages import tr
from robolink.model import Controller, ToolReceipt, json_fields, json_value, require_engineer
from robolink.transaction import Order, Wanted, change_tools, finish_order
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit, json_is_on, note, say, show_requests, table
from robolink_cli.options.consent import DryRun, Overwrite, Published, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import AcceptedAngle, AcceptedLength, accepted_jump, agree
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
from robolink_cli.views.documents import number, receipt_payload, show_change


def backup_payload(backup: Backup, file: Path) -> dict[str, object]:
    """Return what was saved."""
    tools = backup.state.tools
    return {
        "file": str(file),
        **json_fields(backup, "controller", "saved_at", "facts"),
        "selected_tool": backup.state.selected,
        "tools": {str(tool): json_value(offset) for tool, offset in tools.items()},
    }


def show_backup(backup: Backup, file: Path) -> None:
    """Show what was saved, and of which controller."""
    facts, tools = backup.facts, backup.state.tools
    unknown = tr("unknown")
    say(
        tr(
            "{url}: robot {models}, serial {serials}, firmware {firmware}",
            url=backup.controller,
            models=", ".join(facts.robot_models) or unknown,
            serials=", ".join(facts.robot_serials) or unknown,
            firmware=facts.firmware or unknown,
        )
    )
    say(
        tr(
            "Saved in {file}: {defined} of {count} tools are defined.",
            file=file,
            defined=sum(offset is not None for offset in tools.values()),
            count=len(tools),
        )
    )
    if backup.state.selected is not None:
        say(tr("Tool {tool} is selected.", tool=backup.state.selected))


def comparison_payload(comparison: Comparison, tolerance: ComparisonTolerance) -> dict[str, object]:
    """Return every tool that differs, with all its components."""
    return {
        "equal": comparison.equal,
        "tolerance_mm": tolerance.length_mm,
        "tolerance_deg": tolerance.angle_deg,
        "selected_tool": json_fields(
            comparison,
            expected="expected_selected",
            found="found_selected",
            equal="same_selection",
            counts="selection_counts",
        ),
        "differing": [_tool_payload(tool) for tool in comparison.differing],
    }


def show_comparison(comparison: Comparison, tolerance: ComparisonTolerance, identity: str) -> None:
    """Print a row for each component of each tool that differs."""
    rows = [row for tool in comparison.differing for row in _rows(tool)]
    if rows:
        columns = (
            tr("tool"),
            "",
            tr("file"),
            tr("controller"),
            tr("difference"),
            tr("allowed"),
            "",
        )
        table(identity, columns, rows)
    if not comparison.same_selection:
        say(
            tr(
                "  selected tool: {expected} in the file, {found} on the controller",
                expected=comparison.expected_selected,
                found=comparison.found_selected,
            )
        )
    if comparison.equal:
        say(
            tr(
                "Equal: all tools of {url} match the file, within {mm:g} mm and {deg:g} deg.",
                url=identity,
                mm=tolerance.length_mm,
                deg=tolerance.angle_deg,
            )
        )
    elif rows:
        numbers = ", ".join(str(tool.tool) for tool in comparison.differing)
        say(tr("Different tools: {numbers}.", numbers=numbers))


def _tool_payload(tool: ToolComparison) -> dict[str, object]:
    parts = [json_fields(part) | {"equal": part.equal} for part in tool.components]
    return {**json_fields(tool, "tool", "expected", "found"), "components": parts}


def _rows(tool: ToolComparison) -> list[list[object]]:
    if not tool.components:
        defined, undefined = tr("defined"), tr("undefined")
        sides = (tool.expected, tool.found)
        return [[tool.tool, "", *(undefined if s is None else defined for s in sides), "", "", "<"]]
    return [
        [
            tool.tool,
            part.name.replace("_", " ").upper().replace("MM", "mm").replace("DEG", "deg"),
            number(part.expected),
            number(part.found),
            f"{part.delta:+.3f}",
            f"{part.tolerance:g}",
            "" if part.equal else "<",
        ]
        for part in tool.components
        if part.expected or part.found or not part.name.startswith(("v", "w"))
    ]


_FILE = click.Path(dir_okay=False, path_type=Path)


@click.command()
@controller_options
def backup(
    context: CliContext,
    *,
    file: Annotated[Path, _FILE, CliArgument()],
    force: Overwrite = False,
    order: OrderId = None,
) -> None:
    """Save all fifteen tools, the selected tool and the controller's identity. Reads only."""
    from robolink.backup import backup_to_text, save, take_backup
    from robolink.files.named import require_free

    if order is None:
        require_free(file, replace=force)
    with open_controller(context) as controller, ordered(controller, order, "tool backup") as found:
        if found is not None and found.done is not None:
            done = found
            emit("backup-saved", with_order(found.done.result, found), lambda: show_done(done))
            return
        require_free(file, replace=force)
        taken = take_backup(controller)
        payload = backup_payload(taken, file)
        if found is not None:
            data = backup_to_text(taken).encode("ascii")
            finish_order(controller, found, payload, files={file: data})
        save(taken, file, replace=force)
    emit("backup-saved", with_order(payload, found), lambda: show_backup(taken, file))


@click.command()
@controller_options
def compare(
    context: CliContext,
    *,
    file: Annotated[Path, _FILE, CliArgument()],
    length_mm: Annotated[
        float,
        NumberInside(min=0),
        CliOption("--tolerance", help="Ignore differences of X, Y, Z up to this."),
    ] = 0.0005,
    angle_deg: Annotated[
        float,
        NumberInside(min=0),
        CliOption("--tolerance-deg", help="Ignore differences of U, V, W up to this."),
    ] = 0.0005,
    ignore_selected: Annotated[
        bool,
        CliOption(
            help="Show a different selected tool, but do not count it: programs select "
            "tools themselves."
        ),
    ] = False,
    published: Published = False,
) -> int:
    """Show the differences from a backup. Exit code 1 if there are any. Reads only.

    The file may be from another controller: you can compare one good file with many cells.
    """
    from robolink.backup import compare as compare_tools
    from robolink.backup import load
    from robolink_cli.session.context import find_tools

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
    emit("compare", payload, lambda: show_comparison(comparison, tolerance, identity))
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
        bool, CliOption(help="Accept a backup from another controller.")
    ] = False,
    accepted_mm: AcceptedLength = None,
    accepted_deg: AcceptedAngle = None,
    order: OrderId = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Write the tools of a backup that differ: all or none, each only if nobody changed it.

    A tool that is undefined in the backup is cleared. Nothing else changes. Before a change beyond
    the cell's max_change_mm or max_change_deg it asks, even with --yes.
    """
    from robolink.backup import (
        backup_to_text,
        load,
        plan_restore,
        read_tools,
        require_same_controller,
    )

    require_no_dry_run(order, dry_run=dry_run)
    wanted = load(file)
    # The same name with other values in it is another job.
    backed_up = sha256(backup_to_text(wanted).encode("ascii")).hexdigest()
    with (
        open_controller(context, changes=not dry_run) as controller,
        ordered(controller, order, "tool restore", backup=backed_up) as found,
    ):
        if found is not None and found.done is not None:
            done = found
            emit("restore", with_order(found.done.result, found), lambda: show_done(done))
            return
        if not other_controller:
            require_same_controller(wanted, controller.identity, controller.facts())
        plan = plan_restore(wanted, read_tools(controller), tools=tools, selected=selected)
        restoration = Restoration(controller, plan, file, order=found)
        requests = restoration.requests()
        if dry_run:
            show_requests(requests)
            return
        if not plan.empty:
            if not json_is_on():
                restoration.show()
            agree(
                tr("Write these values to the controller? 'robolink undo' undoes it."),
                yes=yes,
                asks=not json_is_on(),
            )
        payload = restoration.run(accepted_mm=accepted_mm, accepted_deg=accepted_deg)
    emit("restore", with_order(payload, found), restoration.show_end)


class Restoration:
    """One restore of one controller, as one change.

    Args:
        controller: The controller, connected.
        plan: What to do.
        file: Where the backup is.
        order: The order that it carries out.
    """

    def __init__(
        self, controller: Controller, plan: RestorePlan, file: Path, *, order: Order | None = None
    ) -> None:
        self._controller = controller
        self._plan = plan
        self._file = file
        self._order = order

    def requests(self) -> list[str]:
        """Return what would be sent besides reads; finds what the controller cannot store.

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
            # The selection that replaces it is already shown.
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
            accepted_mm: The length of a jump that was accepted in advance.
            accepted_deg: The angle of a jump that was accepted in advance.
        """
        selected = self._controller.tools.selected()
        if self._plan.select is not None:
            selected = self._plan.select

        def document(receipts: Sequence[ToolReceipt]) -> dict[str, object]:
            restored = [receipt_payload(receipt) for receipt in receipts]
            return {"file": str(self._file), "restored": restored, "selected_tool": selected}

        receipts: tuple[ToolReceipt, ...] = ()
        if self._plan.empty:
            if self._order is not None:
                finish_order(self._controller, self._order, document(()))
        else:
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
                receipts = change_tools(
                    self._controller,
                    [
                        Wanted(change.tool, change.wanted, change.now, then_select=then)
                        for change, then in self._in_order()
                    ],
                    tell=note,
                    order=self._order,
                    describe=document,
                    select=self._plan.select,
                )
        return document(receipts)

    def _in_order(self) -> Iterator[tuple[RestoreChange, int | None]]:
        """Yield each change, and the tool that is selected before it should it clear that."""
        for change in self._plan.changes:
            yield change, self._plan.select if change.wanted is None else None

    def show_end(self) -> None:
        """Show how it ended."""
        if self._plan.empty:
            say(tr("The controller has these values already. Nothing was written."))
        elif self._plan.changes:
            numbers = ", ".join(str(change.tool) for change in self._plan.changes)
            say(tr("Tools restored and read back: {numbers}.", numbers=numbers))
