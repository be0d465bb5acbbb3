"""fleet plan: a plan from a file, frozen and kept."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from robolink.messages import tr
from robolink_cli.commands.fleet.plant import Operator, begun_at_cells, open_plant, who
from robolink_cli.console.render import emit, say, say_listed
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from robolink.fleet import Plan


@click.command("plan", short_help="Make a plan from a file, and keep it.")
@json_option
def plan(
    *,
    file: Annotated[Path, CliArgument()],
    operator: Operator = None,
    dry_run: Annotated[bool, CliOption(late=True, help="Show the plan; keep nothing.")] = False,
) -> None:
    """Make a plan from FILE, and keep it. Nothing begins yet.

    The cells, their homes and the recipe are those of now: what changes in the files later does not
    change the plan. docs/fleet.md explains every key.
    """
    from robolink.config import load_cell_files
    from robolink.fleet import load_plan

    files = load_cell_files()
    made = load_plan(
        file,
        cells=tuple(files.cells),
        groups=files.groups,
        homes=files.homes,
        author=who(operator),
    )
    if not dry_run:
        with open_plant(missing_ok=True) as store:
            store.add_plan(made, starts=False)
    payload = {**made.document(), "kept": not dry_run}
    del payload["schema"]
    emit("fleet-planned", payload, lambda: _show(made, kept=not dry_run))


def _show(made: "Plan", *, kept: bool) -> None:
    said = {
        tr("plan"): made.id,
        tr("kind"): f"{made.kind}: {made.name}",
        tr("cells"): str(len(made.cells)),
    }
    for number, ring in enumerate(made.rings, start=1):
        said[tr("ring {number}", number=number)] = _listed(ring)
    for home in dict.fromkeys(made.homes.values()):
        cells = [cell for cell in made.cells if made.homes[cell] == home]
        said[tr("home {name}", name=home)] = _listed(cells)
    if made.recipe:
        said[tr("recipe")] = f"{made.recipe} (SHA-256 {made.recipe_hash[:12]})"
    if made.window:
        said[tr("window")] = made.window
    say_listed(said)
    if not kept:
        say(tr("Nothing was kept."))
        return
    if made.needs_permit:
        say(tr("It waits for a permit: robolink fleet permit give"))
    if made.kind.moves:
        say(begun_at_cells(made.id))
    say(tr("To start it: robolink fleet run {plan}", plan=made.id))
    say(tr("How it stands: robolink fleet status {plan}", plan=made.id))


def _listed(cells: Sequence[str]) -> str:
    """Return how many cells there are, and the first of them."""
    return f"{len(cells)}: {', '.join(cells[:4])}{' ...' if cells[4:] else ''}"
