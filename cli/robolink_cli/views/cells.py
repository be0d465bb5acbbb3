"""What ``cell list``, ``show``, ``people``, ``files`` and ``validate`` show."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from robolink.config import (
    USUAL_CHANGE_MM,
    Cell,
    CellSettings,
    check_file,
    config_files,
    load_cells,
    settings_of_file,
)
from robolink.errors import ConfigError
from robolink.files.toml import Problem
from robolink.journal import default_location, named_by_environment, shown_location
from robolink.messages import tr
from robolink.methods import AnyMethod, Check, all_methods, parameter_problems
from robolink.stations import StationKind
from robolink.timing import local_label
from robolink.transport import parse_url
from robolink_cli.access.cell import link_options
from robolink_cli.console.render import say, table
from robolink_cli.console.tables import columns, padded
from robolink_cli.options.shared import origin_of
from robolink_cli.session.context import CliContext
from robolink_cli.views.documents import AXES, offset_cells

_OF_TOUCHES = ("lift_mm", "clearance_mm")


def refused_by_methods(settings: "CellSettings") -> Iterator[Problem]:
    """Yield what methods would refuse in the limits of a cell, in the words of that refusal.

    A method takes what is usual for it in place of what the cell does not say. Where the cell says
    nothing about touches at all, nothing is refused.

    Args:
        settings: What the cell file says of the cell.
    """
    refusals: dict[Problem, list[str]] = {}
    for method in all_methods():
        for problem in _refusals(method, settings):
            refusals.setdefault(problem, []).append(method.name)
    for problem, names in refusals.items():
        methods = ", ".join(names)
        said = tr(
            "{why} These methods are not possible: {methods}.", why=problem.what, methods=methods
        )
        yield Problem(problem.where, said)


def _refusals(method: AnyMethod, settings: "CellSettings") -> Iterator[Problem]:
    if method.needs.station is not StationKind.PIN or not method.needs.motion:
        return
    usual = method.parameters()
    said = {
        name: value
        for name in _OF_TOUCHES
        if hasattr(usual, name) and (value := getattr(settings, name)) is not None
    }
    limit_mm = settings.max_change_mm
    if not hasattr(usual, "clearance_mm") or not (said or limit_mm is not None):
        return
    parameters = method.parameters(**said)
    for problem in parameter_problems(method, parameters, Check(given=said)):
        if problem.where in _OF_TOUCHES:
            yield problem
    clearance_mm = parameters.clearance_mm
    largest_mm = USUAL_CHANGE_MM if limit_mm is None else limit_mm
    if clearance_mm < largest_mm:
        from robolink.calibration_run import clearance_too_small  # with numpy; a listing needs none

        where = "clearance_mm" if "clearance_mm" in said else "max_change_mm"
        yield Problem(where, clearance_too_small(clearance_mm, largest_mm))


def files_payload() -> list[dict[str, object]]:
    """Return the places searched, the one with precedence first."""
    return [
        {"source": file.source, "path": str(file.path), "exists": file.path.is_file()}
        for file in config_files()
    ]


def show_files(files: Sequence[Mapping[str, object]]) -> None:
    """Print the places, one a line."""
    why = {
        "named": tr("named by ROBOLINK_CONFIG"),
        "folder": tr("from the working folder"),
        "user": tr("from the user's folder"),
        "site": tr("for everybody on this computer"),
    }
    for file in files:
        found = tr("exists") if file["exists"] else tr("not there")
        say(f"{file['path']}\n    {why[str(file['source'])]}: {found}")


def check_payload(file: Path | None) -> dict[str, Any]:
    """Return the errors of one file, or of all in use and between them.

    Where there is none, nothing was checked, and that is wrong too: a pipeline in another folder
    than it should be would go on.
    """
    paths = [file] if file else [found.path for found in config_files() if found.present]
    files = [_checked(path) for path in paths]
    disagreement = None
    if all(not entry["problems"] for entry in files):
        try:
            _add_refusals(files, file)
        except ConfigError as error:
            disagreement = error.what
    ok = bool(files) and disagreement is None and all(not entry["problems"] for entry in files)
    return {"ok": ok, "files": files, "disagreement": disagreement}


def show_check(payload: Mapping[str, Any]) -> None:
    """Print the problems, or that there are none."""
    for entry in payload["files"]:
        state = tr("wrong") if entry["problems"] else tr("right")
        say(f"{entry['path']}: {state}")
        for problem in entry["problems"]:
            say("    " + ": ".join(filter(None, (problem["where"], problem["what"]))))
    if payload["disagreement"]:
        say(payload["disagreement"])
    if not payload["files"]:
        say(
            tr(
                "There is no cell file to check; 'robolink cell files' shows where robolink "
                "looks for one."
            )
        )


def cells_payload(cells: Iterable[Cell]) -> dict[str, Any]:
    """Return the cells with their addresses."""
    return {
        "cells": {
            cell.name: {"url": cell.url, "robot": cell.settings.robot, "notes": cell.settings.notes}
            for cell in cells
        }
    }


def show_cells(payload: Mapping[str, Any]) -> None:
    """Print one cell a line."""
    cells = payload["cells"]
    width = max((columns(name) for name in cells), default=0)
    for name, cell in cells.items():
        say(f"{padded(name, width)}  {cell['url']}  {cell['robot'] or ''}".rstrip())
    if not cells:
        say(
            tr(
                "There is no cell; 'robolink cell files' shows where robolink looks for a "
                "cell file."
            )
        )


def people_payload(cells: Iterable[Cell]) -> dict[str, Any]:
    """Return the people of each cell; ``None`` if its file names nobody."""
    named = {
        cell.name: None
        if cell.settings.people is None
        else {person: str(role) for person, role in cell.settings.people.items()}
        for cell in cells
    }
    return {"cells": named}


def show_people(payload: Mapping[str, Any]) -> None:
    """Print the people of each cell, one a line."""
    for name, people in payload["cells"].items():
        if people is None:
            say(tr("{cell}: nobody is named, so everybody may do everything.", cell=name))
            continue
        say(tr("{cell}:", cell=name))
        width = max((len(person) for person in people), default=0)
        for person, role in people.items():
            say(f"  {person:{width}}  {role}")
    if not payload["cells"]:
        say(
            tr(
                "There is no cell; 'robolink cell files' shows where robolink looks for a "
                "cell file."
            )
        )


def cell_payload(cell: Cell, context: CliContext, *, origin: bool) -> dict[str, Any]:
    """Return a cell's active values, and with ``origin`` where each came from."""
    values = cell.settings.model_dump(exclude_none=True)
    origins = {key: str(path) for key, path in cell.origins.items()}
    said = link_options(cell)
    defaults = CliContext()
    for key in ("password_file", "timeout_s", "remote_timeout_s"):
        given = origin_of(key)
        if given is not None:
            values[key], origins[key] = getattr(context, key), given
        elif key not in values and key != "password_file":
            values[key] = said.get(key, getattr(defaults, key))
            origins[key] = tr("default")
    place = default_location(parse_url(cell.url).address)
    values["journal"] = shown_location(place)
    variable = named_by_environment()
    origins["journal"] = variable or origins.get("journal", tr("default"))
    payload: dict[str, Any] = {"cell": cell.name, "values": values}
    return payload | {"origins": origins} if origin else payload


def show_cell(payload: Mapping[str, Any]) -> None:
    """Print one value a line."""
    values, origins = payload["values"], payload.get("origins", {})
    say(f"[cells.{payload['cell']}]")
    names = max(len(name) for name in values)
    texts = {name: _shown(value) for name, value in values.items()}
    width = max(len(text) for text in texts.values()) if origins else 0
    for name, text in texts.items():
        say(f"  {name:{names}}  {text:{width}}  {origins.get(name, '')}".rstrip())
    if not values["remote_timeout_s"]:
        say(
            tr(
                "The robot stays still: nobody has confirmed the controller's time-out for this "
                "cell."
            )
        )


def _add_refusals(files: Sequence[Mapping[str, Any]], alone: Path | None) -> None:
    """Add to each correct file what methods refuse of its limits.

    Args:
        files: The files, as the document has them.
        alone: The one file that is looked at; ``None`` for all, each adding to farther ones.

    Raises:
        ConfigError: The files do not go together.
    """
    cells: list[tuple[str, CellSettings, Mapping[str, Path]]]
    if alone is not None:
        cells = [(name, said, {}) for name, said in settings_of_file(alone).items()]
    else:
        cells = [(cell.name, cell.settings, cell.origins) for cell in load_cells().values()]
    for name, settings, origins in cells:
        for problem in refused_by_methods(settings):
            origin = alone or origins.get(problem.where) or _first_origin(origins)
            (entry,) = (entry for entry in files if entry["path"] == str(origin))
            where = f"cells.{name}.{problem.where}"
            entry["problems"].append({"where": where, "what": problem.what})


def _first_origin(origins: Mapping[str, Path]) -> Path:
    """Return a file with keys about touches."""
    keys = ("lift_mm", "clearance_mm", "max_change_mm")
    return next(origins[key] for key in keys if key in origins)


def _checked(path: Path) -> dict[str, Any]:
    try:
        problems = [{"where": problem.where, "what": problem.what} for problem in check_file(path)]
    except ConfigError as error:
        problems = [{"where": "", "what": error.what}]
    return {"path": str(path), "problems": problems}


def _shown(value: object) -> str:
    if isinstance(value, dict):
        # Budget rows are numbers; for people and stations the names are enough.
        return ", ".join(
            f"{name} {one:g}" if isinstance(one, float) else name for name, one in value.items()
        )
    return f"{value:g}" if isinstance(value, float) else str(value)


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
        return tr("never by robolink")
    by = told["nozzle"] or told["operator"] or ""
    return f"{local_label(told['changed_at'])}  {by}".rstrip()


def _age(days: float | None) -> str:
    if days is None:
        return "-"
    return tr("{n} days", n=round(days)) if days >= 1 else tr("today")
