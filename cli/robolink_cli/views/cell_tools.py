"""The page of all tools of a cell."""

from collections.abc import Mapping
from typing import Any

from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.console.render import say, table
from robolink_cli.views.documents import offset_cells
from robolink_cli.views.journal import AXES


def show_cell_tools(payload: Mapping[str, Any]) -> None:
    """Print the tools, one a row, and below it what is due.

    Args:
        payload: The document of it.
    """
    tools, selected = payload["tools"], payload["selected_tool"]
    if not tools:
        say(tr("No tool is defined."))
        return
    rows = []
    for number, told in tools.items():
        x, y, z, u, *_ = offset_cells(told["offset"])
        mark = "*" if int(number) == selected else " "
        rows.append([f"{mark}{number}", x, y, z, u, _changed(told), _age(told["age_days"])])
    heads = (tr("tool"), *AXES[:4], tr("last change"), tr("age"))
    table(tr("tools (* selected)"), heads, rows)
    for told in tools.values():
        for sentence in told["due"]:
            say(sentence)


def _changed(told: Mapping[str, Any]) -> str:
    if told["changed_at"] is None:
        return tr("never from here")
    by = told["nozzle"] or told["operator"] or ""
    return f"{local_label(told['changed_at'])}  {by}".rstrip()


def _age(days: float | None) -> str:
    if days is None:
        return "-"
    return tr("{n} days", n=round(days)) if days >= 1 else tr("today")
