"""cell tools: all tools of a cell on one page, each with its last change and what is due."""

from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.render import emit
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.model import Controller, ToolOffset

_A_DAY_S: Final = 86_400


@click.command("tools")
@controller_options
def cell_tools(context: CliContext) -> None:
    """Show each defined tool: its value, its last change and how old that is, and what is due.

    Reads only. The due dates come from the recipes beside the cell file and from the record.
    """
    from robolink_cli.session.context import find_tools
    from robolink_cli.views.cells import show_cell_tools

    with open_controller(context, looks=True) as controller:
        found = find_tools(controller, published=False)
        left = _changes_left(context)
        tools = {
            str(number): _told(controller, number, offset, left.get(number))
            for number, offset in found.tools.items()
            if offset is not None
        }
    payload: dict[str, object] = {
        "controller": controller.identity,
        "selected_tool": found.selected,
        "tools": tools,
    }
    emit("cell-tools", payload, lambda: show_cell_tools(payload))


def _told(
    controller: "Controller", number: int, offset: "ToolOffset", left: int | None
) -> Mapping[str, object]:
    """Return what is known of one tool, as JSON."""
    from robolink.model import EntryKind, json_value
    from robolink.transaction import changed_since
    from robolink_cli.session.cell_recipes import due_in

    last = next(controller.outcomes.recorded(tool=number, kinds=(EntryKind.DONE,)), None)
    since = changed_since(controller, number, offset)
    due = [] if since is None else [since.sentence]
    if left is not None:
        due.append(tr("Tool {tool}: {said}", tool=number, said=due_in(left)))
    signature = None if last is None else last.signature
    return {
        "offset": json_value(offset),
        "changed_at": last and last.at,
        "age_days": None if last is None else _days_since(last.at),
        "change": last and last.change,
        "nozzle": signature and signature.nozzle,
        "operator": signature and signature.operator,
        "recipe": signature and signature.recipe,
        "as_recorded": None if last is None else since is None,
        "changes_left": left,
        "due": due,
    }


def _changes_left(context: CliContext) -> dict[int, int]:
    """Return how many changes each tool may have before a full calibration, by the recipes."""
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.recipe import changes_left_of, load_recipe
    from robolink_cli.session.cell_recipes import recipes_at
    from robolink_cli.session.completion import address_of

    address, name = address_of(context.url), context.cell.name if context.cell else ""
    if not (address and may_exist(default_location(address))):
        return {}
    journal = open_journal(address=address, read_only=True)
    left: dict[int, int] = {}
    for path in recipes_at(context.cell):
        # The command that runs a recipe reports its errors.
        with suppress(ConfigError):
            loaded = load_recipe(path)
            if loaded.recipe.is_for(name):
                for tool, changes in changes_left_of(loaded, journal, address).items():
                    left[tool] = min(changes, left.get(tool, changes))
    return left


def _days_since(at: str) -> float | None:
    from robolink.timing import wall_time

    # The date in a damaged record gives no age.
    with suppress(ValueError):
        then = datetime.fromisoformat(at)
        age = wall_time() - (then if then.tzinfo else then.replace(tzinfo=UTC))
        return round(max(age.total_seconds(), 0.0) / _A_DAY_S, 2)
    return None
