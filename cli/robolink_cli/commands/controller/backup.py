"""backup, restore, compare: the tools of a controller and a file."""

from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.consent import dry_run_option, published_option, yes_option
from robolink_cli.prompts.jumps import accept_jump_options
from robolink_cli.prompts.questions import agree
from robolink_cli.session.completing import complete_tool
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.opening import open_controller

_FILE = click.Path(dir_okay=False, path_type=Path)


@click.command()
@click.argument("file", type=_FILE)
@click.option("--force", is_flag=True, help="Overwrite a file that is already there.")
@controller_options
def backup(context: CliContext, file: Path, force: bool) -> None:
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
@click.argument("file", type=_FILE)
@click.option(
    "--tolerance",
    "length_mm",
    type=NumberInside(min=0),
    default=0.0005,
    metavar="MM",
    show_default=True,
    help="Largest difference of X, Y, Z that counts as none.",
)
@click.option(
    "--tolerance-deg",
    "angle_deg",
    type=NumberInside(min=0),
    default=0.0005,
    metavar="DEG",
    show_default=True,
    help="Largest difference of U, V, W that counts as none.",
)
@click.option(
    "--ignore-selected",
    is_flag=True,
    help="Show another selected tool, but do not count it: a program selects tools by itself.",
)
@published_option
@controller_options
def compare(
    context: CliContext,
    file: Path,
    *,
    length_mm: float,
    angle_deg: float,
    ignore_selected: bool,
    published: bool,
) -> int:
    """Show what differs from a backup. Exit code 1 when something does. Reads only.

    The file may be of another controller: one good file can be compared with many cells.
    """
    from robolink.backup import ComparisonTolerance, load
    from robolink.backup import compare as compare_tools
    from robolink_cli.session.tool_source import find_tools
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
@click.argument("file", type=_FILE)
@click.option(
    "--tool",
    "tools",
    type=int,
    metavar="N",
    multiple=True,
    shell_complete=complete_tool,
    help="Only this tool; may be repeated.",
)
@click.option("--selected", is_flag=True, help="Also select the backup's tool.")
@click.option(
    "--other-controller",
    is_flag=True,
    help="The backup is of another controller and is still meant for this one.",
)
@accept_jump_options
@controller_options
@dry_run_option
@yes_option
def restore(
    context: CliContext,
    file: Path,
    *,
    tools: tuple[int, ...],
    selected: bool,
    other_controller: bool,
    accepted_mm: float | None,
    accepted_deg: float | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Write the tools of a backup that differ, each only if nobody changed it meanwhile.

    A tool that is undefined in the backup is cleared. Nothing else is changed. A change beyond
    the cell's max_change_mm or max_change_deg is asked about, even with --yes.
    """
    from robolink.backup import load, plan_restore, read_tools, require_same_controller
    from robolink_cli.commands.controller.restoration import Restoration

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
