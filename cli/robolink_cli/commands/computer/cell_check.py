"""cell check: unexpected changes of cells, and overdue checks. Moves nothing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import click

from robolink.calibration_run import RecipeRun
from robolink.config import Cell
from robolink.errors import ConfigError, DeclinedError, NotReadyError, RobolinkError
from robolink.inspection import InspectionFinding, measured_findings
from robolink.messages import tr
from robolink.model import Controller
from robolink.recipe import LoadedRecipe, load_recipe
from robolink_cli.access.cell import complete_cell
from robolink_cli.console.exit_codes import DIFFERENT, exit_code
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, note, say
from robolink_cli.options.consent import Published
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.operator import terminal
from robolink_cli.session.completion import complete_recipe
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, context_of_cell, optional_controller
from robolink_cli.session.motion_consent import agree_to_motion, motion_question

if TYPE_CHECKING:
    from robolink.backup import ToolState
    from robolink.inspection import Inspection
    from robolink.model import NewEntry


class CheckScope(NamedTuple):
    """What is checked, and how.

    Attributes:
        published: Whether the tools are those that the companion program published.
        since: Changes before this day are left out of the charts; empty for none.
        sensor: What measures besides, ``None`` for nothing: then nothing moves.
    """

    published: bool
    since: str
    sensor: "SensorCheck | None"


class CheckedCell(NamedTuple):
    """One cell that was checked, or could not be.

    Attributes:
        name: Its name, or its URL where it has none.
        inspection: What was found; ``None`` where it could not be looked at.
        error: Why not, or not further.
    """

    name: str
    inspection: "Inspection | None"
    error: RobolinkError | None = None

    @property
    def well(self) -> bool:
        """Whether it was checked and needs no attention."""
        found = self.inspection
        return self.error is None and found is not None and not found.findings


@click.command()
@optional_controller
def check(
    context: CliContext,
    *,
    cells: Annotated[
        tuple[str, ...], CliArgument(metavar="[CELL]...", shell_complete=complete_cell)
    ] = (),
    since: Annotated[
        datetime | None,
        click.DateTime(["%Y-%m-%d"]),
        CliOption(
            metavar="YYYY-MM-DD", help="Start the charts again from this day, after a repair (UTC)."
        ),
    ] = None,
    recipe: Annotated[
        Path | None,
        CliOption(
            "--measure",
            metavar="RECIPE.toml",
            shell_complete=complete_recipe,
            help="Also measure the tips with the sensor of this recipe; the robot moves "
            "after you confirm on a terminal. Writes nothing.",
        ),
    ] = None,
    published: Published = False,
) -> int:
    """Check cells for unexpected changes and overdue checks, for example nightly. Moves nothing.

    Without CELL it checks the cell of -c, or else all cells of the cell files: tools against their
    last confirmed values, due dates of stations, and the trend of the changes against its limits.
    Each check is one entry in the journal. Exit code 1 when something needs attention; when a cell
    could not be checked, the code that says why.
    """
    contexts = _contexts(context, cells)
    sensor = None if recipe is None else SensorCheck.of(recipe, cells=len(contexts))
    scope = CheckScope(published, f"{since:%Y-%m-%d}" if since else "", sensor)
    checked = [_checked(one, scope) for one in contexts]
    payload = {"ok": all(one.well for one in checked), "cells": [_payload(one) for one in checked]}
    emit("check", payload, lambda: _show(checked))
    for one in checked:
        if one.error is not None:
            return exit_code(one.error)
    return 0 if payload["ok"] else DIFFERENT


def _contexts(context: CliContext, names: Sequence[str]) -> list[CliContext]:
    """Return each selected cell.

    Raises:
        ConfigError: There is none of that name, or none at all.
    """
    if not names:
        if context.url is not None:
            return [context]
        from robolink.config import cell_names

        names = cell_names()
        if not names:
            context.require_url()
    return [context_of_cell(name) for name in names]


def _checked(context: CliContext, scope: CheckScope) -> CheckedCell:
    """Check one cell; the result names what prevented a check."""
    name = context.cell.name if context.cell else context.require_url()
    seen: list[Inspection] = []
    try:
        _inspect(context, scope, seen)
    except RobolinkError as error:
        if not (seen or isinstance(error, ConfigError)):
            _record_that_nobody_looked(context, error)
        return CheckedCell(name, seen[-1] if seen else None, error)
    return CheckedCell(name, seen[-1])


def _inspect(context: CliContext, scope: CheckScope, seen: "list[Inspection]") -> None:
    """Check one cell and record the findings.

    Args:
        context: The cell.
        scope: What is looked at, and how.
        seen: Takes what was found; by reading, then with what was measured.

    Raises:
        RobolinkError: What keeps it from being looked at, or from being looked at further.
    """
    from robolink.inspection import inspect
    from robolink_cli.session.context import find_tools

    with open_controller(context, quiet=True, changes=scope.sensor is not None) as controller:
        tools: ToolState | NotReadyError
        try:
            tools = find_tools(controller, published=scope.published)
        except NotReadyError as error:
            tools = error
        seen.append(inspect(controller, tools, cell=context.cell, since=scope.since))
        try:
            if scope.sensor is not None:
                measured = scope.sensor.findings(controller, context.cell)
                seen.append(seen[-1].with_findings(measured))
        finally:
            controller.outcomes.append(seen[-1].entry)


def _record_that_nobody_looked(context: CliContext, error: RobolinkError) -> None:
    """Record that a cell could not be checked; show it if that cannot be recorded."""
    from robolink import __version__
    from robolink.journal import open_log, signature_here
    from robolink.transport import parse_url

    try:
        log = open_log(
            parse_url(context.require_url()).address,
            durable=True,
            signature=signature_here(__version__),
        )
        try:
            log.append(_not_looked(error))
        finally:
            log.close()
    except ConfigError as broken:
        note(broken.what)


def _not_looked(error: RobolinkError) -> "NewEntry":
    from robolink.model import EntryKind, NewEntry

    verdict = tr("The cell could not be checked: {what}", what=error.what)
    return NewEntry(EntryKind.CHECK, verdict=verdict, details={"error": type(error).__name__})


def _payload(one: CheckedCell) -> Mapping[str, object]:
    """Return what is known of one cell; ``None`` for what could not be checked."""
    from robolink.model import json_value

    error = one.error and {
        "kind": type(one.error).__name__,
        "what": one.error.what,
        "remedy": one.error.remedy,
    }
    found = one.inspection
    tools = found and {str(number): json_value(it) for number, it in found.tools.items()}
    return {
        "cell": one.name,
        "ok": one.well,
        "error": error,
        "controller": found and found.controller,
        "tools": tools,
        "selected_tool": found and found.selected,
        "stations": found and list(found.stations),
        "changes": found and found.changes,
        "findings": [
            {"code": f.code, "subject": f.subject, "sentence": f.sentence, "remedy": f.remedy}
            for f in (found.findings if found else ())
        ],
    }


def _show(checked: Sequence[CheckedCell]) -> None:
    """Print one line a cell, its findings below it; cells with findings first."""
    for one in sorted(checked, key=lambda one: one.well):
        if one.inspection is None:
            say(tr("{cell}: could not be checked.", cell=one.name))
            say(f"  {one.error}")
            continue
        if one.well:
            say(
                tr(
                    "{cell}: no problem found (tools read: {tools}, stations: {stations}, "
                    "measured changes on record: {changes}).",
                    cell=one.name,
                    tools=len(one.inspection.tools),
                    stations=len(one.inspection.stations),
                    changes=one.inspection.changes,
                )
            )
            continue
        say(tr("{cell}: needs attention.", cell=one.name))
        for found in one.inspection.findings:
            say(f"  {found.sentence}")
            if found.remedy:
                say(f"    {found.remedy}")
        if one.error is not None:
            say(f"  {one.error}")


@dataclass(frozen=True, slots=True)
class SensorCheck:
    """Measures as a recipe says.

    Attributes:
        loaded: The recipe.
    """

    loaded: LoadedRecipe

    @classmethod
    def of(cls, recipe: Path, *, cells: int) -> "SensorCheck":
        """Return the check by a recipe.

        Raises:
            ConfigError: The recipe is wrong, or several cells are to be measured at a time.
            DeclinedError: Nobody is there to say yes; nothing was asked of a controller.
        """
        if cells != 1:
            raise ConfigError(
                tr("Only one cell can be measured at a time, because somebody has to watch it."),
                remedy=tr("Name the cell."),
            )
        loaded = load_recipe(recipe)
        if not person_here():
            raise DeclinedError(
                tr("The robot would move, but there is nobody to ask."),
                remedy=tr(
                    "A check moves the robot only if a person confirms: run it on a terminal."
                ),
            )
        return cls(loaded)

    def findings(self, controller: Controller, cell: Cell | None) -> tuple[InspectionFinding, ...]:
        """Ask, measure, compare.

        Raises:
            DeclinedError: The answer was no; nothing moved.
            RobolinkError: Nothing can move, or the robot could not finish.
        """
        run = RecipeRun(controller, self.loaded, operator=terminal(), cell=cell, measure_only=True)
        run.preflight()
        if run.forecast is not None:
            note(run.forecast.sentence)
        limits = run.plan.limits
        purpose = tr(
            "to measure by the recipe {recipe!r}, without writing", recipe=self.loaded.name
        )
        question = motion_question(
            controller, purpose, speed_mm_s=limits.speed_mm_s, box_mm=limits.box.x_max_mm
        )
        agree_to_motion(question, yes=False)
        return measured_findings(run)
