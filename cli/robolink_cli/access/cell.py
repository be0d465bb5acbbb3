"""Resolves ``-c NAME``, and the values that the cell supplies where the command line has none."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.config import Cell


def is_cell_name(given: str) -> bool:
    """Return whether a name is a cell's and not a URL."""
    return "+" not in given and "://" not in given


def link_options(cell: "Cell") -> dict[str, Any]:
    """Return the cell's settings for reaching its controller, by the names of the options.

    A cell whose file states no remote time-out has none: it cannot be read over the wire
    (docs/reference/epson.md 1.1), so nothing moves until a person states it.
    """
    settings = cell.settings
    said: dict[str, Any] = {"remote_timeout_s": settings.remote_timeout_s or 0.0}
    if settings.timeout_s is not None:
        said["timeout_s"] = settings.timeout_s
    return said


def acceleration_of(cell: "Cell | None") -> int | None:
    """Return the highest acceleration that a cell states; a URL alone states none."""
    return None if cell is None else cell.settings.acceleration_mm_s2


def with_cell_limits(
    cell: "Cell | None", options: Mapping[str, Any], keys: Mapping[str, str]
) -> dict[str, Any]:
    """Return a command's options; untyped ones are taken from the cell.

    Args:
        cell: The cell, if ``-c`` named one.
        options: The options by the names that click gives them.
        keys: For each option that a cell may say, its key in the cell file.
    """
    chosen = dict(options)
    if cell is not None:
        source = click.get_current_context().get_parameter_source
        for option, key in keys.items():
            value = getattr(cell.settings, key)
            if value is not None and source(option) is ParameterSource.DEFAULT:
                chosen[option] = value
    return chosen


def complete_cell(context: click.Context, parameter: click.Parameter, start: str) -> list[str]:  # noqa: ARG001 - click's form
    """Return the cells whose names begin so, for TAB; reads only the cell files."""
    from robolink.config import cell_names

    return [name for name in cell_names() if name.startswith(start)]


def complete_cells(
    context: click.Context,  # noqa: ARG001 - click's form
    parameter: click.Parameter,  # noqa: ARG001 - click's form
    start: str,
) -> list[str]:
    """Return cells and groups whose names begin so, for TAB, where several cells are taken."""
    from robolink.config import GROUP_MARK, cell_names, group_names

    names = [*cell_names(), *(f"{GROUP_MARK}{name}" for name in group_names())]
    return [name for name in names if name.startswith(start)]


def only_cell() -> str:
    """Return the name of the only cell in the cell files, empty if there is none."""
    names = _names()
    return names[0] if len(names) == 1 else ""


def which_cell(name: str) -> str:
    """Return the line that says which cell is used."""
    return tr("cell: {name}", name=name)


def nothing_named() -> ConfigError:
    """Return the error of a command that needs a controller and has none."""
    names = _names()
    if not names:
        return ConfigError(
            tr("No controller is named."),
            remedy=tr(
                "Give -c CELL from a cell file, or a URL, -c epson+tcp://192.168.0.1:5000. To "
                "practise on a simulated robot: robolink docs tutorial"
            ),
        )
    if len(names) == 1:
        return ConfigError(
            tr(
                "No cell is named. A command that moves or writes uses the only cell, "
                "{name}, only if it can ask you first.",
                name=names[0],
            ),
            remedy=tr("Add it: -c {name}", name=names[0]),
        )
    return ConfigError(
        tr("No cell is named, and there are several: {names}.", names=", ".join(names)),
        remedy=tr("Name one of them, for example: -c {name}", name=names[0]),
    )


def _names() -> list[str]:
    from robolink.config import cell_names

    return cell_names()
