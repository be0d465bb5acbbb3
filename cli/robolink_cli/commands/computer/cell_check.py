"""cell check: unexpected changes of cells, and overdue checks. Moves nothing."""

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink import errors
from robolink.calibration_run import RecipeRun
from robolink.config import (
    Cell,
    connect_cell,
    load_cell_files,
    proof_of_files,
    use_journals_of,
)
from robolink.errors import ConfigError, DeclinedError, RobolinkError
from robolink.inspection import (
    CellCheck,
    CheckFailure,
    CheckState,
    InspectionFinding,
    check_cells,
    inspect,
    measured_findings,
    record_check,
)
from robolink.messages import tr
from robolink.model import Controller
from robolink.recipe import LoadedRecipe, load_recipe
from robolink_cli.access.cell import complete_cells, is_cell_name
from robolink_cli.access.record import recording
from robolink_cli.console.exit_codes import DIFFERENT, REFUSED, exit_code_of
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on, note, say
from robolink_cli.options.consent import Published
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.operator import terminal
from robolink_cli.session.completion import complete_recipe
from robolink_cli.session.connection import open_controller, password_of, say_how_protected
from robolink_cli.session.context import (
    CliContext,
    context_of_cell,
    context_with,
    find_tools,
    optional_controller,
)
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.operator_identity import signature_of
from robolink_cli.session.stop_listener import remember_address

if TYPE_CHECKING:
    from robolink.backup import ToolState
    from robolink.errors import NotReadyError
    from robolink.inspection import Inspection


@click.command()
@optional_controller
def check(
    context: CliContext,
    *,
    cells: Annotated[
        tuple[str, ...], CliArgument(metavar="[CELL]...", shell_complete=complete_cells)
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

    CELL is a name, a pattern in quotes ('line3-*') or a group of the cell file (@line3). Without
    CELL it checks the cell of -c, or else all cells of the cell files, many at once: tools against
    their last confirmed values, due dates of stations, and the trend of the changes against its
    limits. Exit code 1 when something needs attention; when a cell could not be checked, the code
    that says why; 5 when somebody was working at a cell.
    """
    contexts, keep_days = _contexts(context, cells)
    begin = f"{since:%Y-%m-%d}" if since else ""
    tools = partial(find_tools, published=published)
    if recipe is not None:
        sensor = SensorCheck.of(recipe, cells=len(contexts))
        checked: Sequence[CellCheck] = [_measured(contexts[0], tools, begin, keep_days, sensor)]
    else:
        checked = _checked(contexts, tools, begin, keep_days)
    payload = {"ok": all(one.well for one in checked), "cells": [_payload(one) for one in checked]}
    emit("check", payload, lambda: _show(checked))
    return _exit_code(checked)


def _exit_code(checked: Sequence[CellCheck]) -> int:
    """Return what comes first: why a cell was not checked, then findings, then who is at work."""
    for one in checked:
        if one.state is CheckState.FAILED and one.failure is not None:
            return exit_code_of(getattr(errors, one.failure.kind, RobolinkError))
    states = {one.state for one in checked}
    if CheckState.ATTENTION in states:
        return DIFFERENT
    return REFUSED if CheckState.BUSY in states else 0


def _contexts(context: CliContext, names: Sequence[str]) -> tuple[list[CliContext], int | None]:
    """Return each selected cell, and for how many days checks are kept; ``None`` for all.

    Raises:
        ConfigError: A name, pattern or group means none, or there is none at all.
    """
    if not names and context.url is not None:
        return [context], load_cell_files().keep_checks_days if context.cell else None
    urls = [name for name in names if not is_cell_name(name)]
    named = [name for name in names if is_cell_name(name)]
    if urls and not named:
        return [context_of_cell(url) for url in urls], None
    files = load_cell_files()
    cells = files.select(named)
    if not (cells or urls):
        context.require_url()
    return [*map(context_with, cells), *map(context_of_cell, urls)], files.keep_checks_days


def _checked(
    contexts: Sequence[CliContext],
    tools: "Callable[[Controller], ToolState]",
    since: str,
    keep_days: int | None,
) -> Sequence[CellCheck]:
    """Check cells, and record that."""
    targets = [one.cell or one.require_url() for one in contexts]
    by_name = {one.cell.name if one.cell else one.require_url(): one for one in contexts}
    use_journals_of(one.cell for one in contexts if one.cell is not None)
    proof = proof_of_files()
    signature = signature_of(contexts[0].operator, None, changes=False)
    recorded = any(one.record for one in contexts)
    for one in contexts:
        say_how_protected(one.require_url(), one.cell.name if one.cell else "")
    with ExitStack() as stack:

        def connect(target: Cell | str) -> Controller:
            at = by_name[target if isinstance(target, str) else target.name]
            controller = _connected(at, stack)
            remember_address(at, proof)
            return controller

        tell = stack.enter_context(_progress(len(targets)))
        return check_cells(
            targets,
            since=since,
            tools=tools,
            connect=connect,
            signature=signature,
            keep_days=keep_days,
            progress=tell,
            tell=note,
            **({"at_once": 1} if recorded else {}),  # dialogues of several cells would mix
        )


def _connected(context: CliContext, stack: ExitStack) -> Controller:
    """Connect to one cell as the command's options and the cell's file say."""
    import robolink

    url = context.require_url()
    signature = signature_of(context.operator, context.expected, changes=False)
    trace = stack.enter_context(recording(context.record, url.partition("?")[0]))
    if context.cell is None:
        return robolink.connect(
            url,
            password=password_of(context),
            timeout_s=context.timeout_s,
            wait_s=context.wait_s,
            trace=trace,
            signature=signature,
        )
    return connect_cell(
        context.cell,
        # Else it is found where the cell's file says.
        password=password_of(context) if context.password_file else None,
        timeout_s=context.timeout_s,
        wait_s=context.wait_s,
        trace=trace,
        signature=signature,
    )


_SHOWN: Final = 20
"""Fewest cells of which progress is shown."""


@contextmanager
def _progress(cells: int) -> Iterator[Callable[[CellCheck], None]]:
    """Show on a terminal how many cells were checked."""
    if cells < _SHOWN or json_is_on() or not sys.stderr.isatty():
        yield lambda _check: None
        return
    with click.progressbar(length=cells, label=tr("checking"), file=sys.stderr) as bar:
        yield lambda _check: bar.update(1)


def _measured(
    context: CliContext,
    tools: "Callable[[Controller], ToolState]",
    since: str,
    keep_days: int | None,
    sensor: "SensorCheck",
) -> CellCheck:
    """Check one cell, measure its tips, and record both."""
    seen: list[Inspection] = []
    failure, reached = None, None
    begun_s = time.monotonic()
    try:
        # Asked once: the answer signs what the measurement records, and the check.
        person = signature_of(context.operator, context.expected, changes=True)
        context = context._replace(operator=person.operator)
        with open_controller(context, quiet=True, changes=True) as controller:
            reached = controller
            read: ToolState | NotReadyError
            try:
                read = tools(controller)
            except errors.NotReadyError as error:
                read = error
            seen.append(inspect(controller, read, cell=context.cell, since=since))
            measured = sensor.findings(controller, context.cell)
            seen[0] = seen[0].with_findings(measured)
    except RobolinkError as error:
        failure = CheckFailure.of(error)
    found = seen[0] if seen else None
    called = context.cell.name if context.cell else context.require_url()
    made = CellCheck(called, found, failure, time.monotonic() - begun_s)
    signature = signature_of(context.operator, context.expected, changes=False)
    target = context.cell or context.require_url()
    return record_check(made, target, controller=reached, signature=signature, keep_days=keep_days)


def _payload(one: CellCheck) -> Mapping[str, object]:
    """Return what is known of one cell; ``None`` for what could not be checked."""
    from robolink.model import json_fields, json_value

    found = one.inspection
    tools = found and {str(number): json_value(it) for number, it in found.tools.items()}
    return {
        "cell": one.cell,
        "ok": one.well,
        "state": str(one.state),
        "error": one.failure and json_fields(one.failure, "kind", "what", "remedy"),
        "controller": found and found.controller,
        "tools": tools,
        "selected_tool": found and found.selected,
        "stations": found and list(found.stations),
        "changes": found and found.changes,
        "findings": [
            json_fields(it, "code", "subject", "sentence", "remedy")
            for it in (found.findings if found else ())
        ],
        "elapsed_s": round(one.seconds, 3),
    }


def _show(checked: Sequence[CellCheck]) -> None:
    """Print one line a cell, its findings below it; cells with findings first."""
    for one in sorted(checked, key=lambda one: one.well):
        found, failure = one.inspection, one.failure
        if one.state is CheckState.BUSY and failure is not None:
            say(tr("{cell}: somebody is working there; not checked.", cell=one.cell))
            say(f"  {failure.what}")
            continue
        if found is None:
            say(tr("{cell}: could not be checked.", cell=one.cell))
        elif one.well:
            say(
                tr(
                    "{cell}: no problem found (tools read: {tools}, stations: {stations}, "
                    "measured changes on record: {changes}).",
                    cell=one.cell,
                    tools=len(found.tools),
                    stations=len(found.stations),
                    changes=found.changes,
                )
            )
        else:
            say(tr("{cell}: needs attention.", cell=one.cell))
            for finding in found.findings:
                say(f"  {finding.sentence}")
                if finding.remedy:
                    say(f"    {finding.remedy}")
        if failure is not None:
            say(f"  {failure.what} {failure.remedy}".rstrip())
    if len(checked) > 1:
        counts = Counter(one.state for one in checked)
        say(
            tr(
                "Cells: {cells}. No problem: {well}. Need attention: {attention}. Not checked: "
                "{failed}. Busy: {busy}.",
                cells=len(checked),
                **{str(state): counts[state] for state in CheckState},
            )
        )


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
