"""cell accuracy: what a cell knows of its accuracy, and measuring one of its rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import isfinite
from pathlib import Path
from typing import Annotated, Final

import click

from robolink.accuracy import (
    MeasuredRow,
    MeasuredTip,
    artefact_row,
    measured_entry,
    measured_tips,
    measuring_step,
    mm_per_px,
    study_row,
    tip_image_row,
    turned_pairs,
)
from robolink.calibration import ACCURACY_ROWS, gauge_study
from robolink.errors import ConfigError
from robolink.messages import spoken, tr
from robolink.model import Controller, EntryKind, json_fields, require_engineer
from robolink.stations import StationKind, find_station
from robolink.timing import wall_time
from robolink_cli.commands.measure.solve.answer import load
from robolink_cli.commands.measure.solve.lasting_cases import study_values
from robolink_cli.console.numbers import NumberInside, decimal
from robolink_cli.console.render import emit, note
from robolink_cli.options.consent import Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE
from robolink_cli.prompts.questions import agree
from robolink_cli.session.completion import complete_station, complete_tool
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.views.accuracy import show_tips

_ROWS = (
    *("touch_mm", "place_mm", "camera_turn_deg", "camera_scale_percent"),
    *("plate_mm", "tip_image_px", "bend_deg", "print_mm"),
)


@click.group(invoke_without_command=True)
@controller_options
def accuracy(
    context: CliContext,
    *,
    robot: Annotated[
        str | None,
        CliOption(
            metavar="NAME",
            help="For a controller with several robots: the robot, as 'station list' names it.",
        ),
    ] = None,
) -> None:
    """Show what is known of a cell's errors that no single measurement shows.

    For each row: its half width, its source and, if it is a default, the command that measures it.
    Reads cell file and journal only; connects to no controller.
    """
    if click.get_current_context().invoked_subcommand is not None:
        return
    from robolink_cli.views.accuracy import accuracy_payload, known_rows, show_accuracy

    known = known_rows(context, robot=robot)
    payload = accuracy_payload(context, known)
    emit("cell-accuracy", payload, lambda: show_accuracy(known))


@accuracy.command("measure", short_help="Record a measured row.")
@controller_options
def measure(
    context: CliContext,
    *,
    row: Annotated[str, click.Choice(_ROWS), CliArgument()],
    tool: Annotated[
        int | None,
        click.IntRange(1, 15),
        CliOption(shell_complete=complete_tool, help="The tool whose recorded calibrations count."),
    ] = None,
    true: Annotated[
        str | None,
        CliOption(metavar="X,Y", help="touch_mm: offset of the gauge tip, by its certificate, mm."),
    ] = None,
    true_sigma_mm: Annotated[
        float | None,
        NumberInside(min=0, min_open=True),
        CliOption(help="touch_mm: standard deviation of that, each coordinate."),
    ] = None,
    study: Annotated[
        Path | None,
        CliOption(help="touch_mm: a gauge study, as for 'expert solve', instead of a gauge tip."),
    ] = None,
    station: Annotated[
        str | None,
        CliOption(
            metavar="ID",
            shell_complete=complete_station,
            help="Only measurements at this station; the row is then valid only there.",
        ),
    ] = None,
    nozzle: Annotated[
        str | None,
        LINE,
        CliOption(metavar="ID", help="Only measurements of the nozzle or gauge tip with this id."),
    ] = None,
    since: Annotated[
        datetime | None,
        click.DateTime(["%Y-%m-%d", "%Y-%m-%dT%H:%M"]),
        CliOption(
            metavar="YYYY-MM-DD[THH:MM]",
            help="Only measurements since then, by this computer's clock; default: the "
            "last 24 hours.",
        ),
    ] = None,
    yes: Yes = False,
) -> None:
    """Calculate ROW from measurements on record, show it, and record it.

    touch_mm: mount a gauge tip with a known offset, calibrate it five times or more as you
    calibrate any needle, then name its tool and its true X,Y here. Or give a gauge study.

    tip_image_px: measure five or more nozzles of one kind by camera, each with its id, turn each
    by half a turn in its mount, measure all again, then name the camera here.

    Other rows are learnt without this command, or stated; it says how.
    """
    asked = Asked(
        tool=tool,
        true=true,
        true_sigma_mm=true_sigma_mm,
        study=study,
        station=station or "",
        nozzle=nozzle or "",
        since=since,
    )
    measure_row(context, row, asked, yes=yes)


_USUAL: Final = timedelta(hours=24)


@dataclass(frozen=True, slots=True)
class Asked:
    """Which measurements count, and what is known of them.

    Attributes:
        tool: The tool; ``None`` for any.
        true: X,Y of the gauge tip, as typed.
        true_sigma_mm: Standard deviation of that.
        study: File of a gauge study.
        station: Name of the station; empty for any.
        nozzle: Id of the nozzle; empty for any.
        since: From when on, by the clock on the wall; ``None`` for the last 24 hours.
    """

    tool: int | None
    true: str | None
    true_sigma_mm: float | None
    study: Path | None
    station: str
    nozzle: str
    since: datetime | None

    @property
    def begin(self) -> str:
        """From when on measurements count, as entries are labelled: ISO 8601 UTC."""
        begin = wall_time() - _USUAL if self.since is None else self.since.astimezone(UTC)
        return begin.astimezone(UTC).isoformat(timespec="milliseconds")


def measure_row(context: CliContext, row: str, asked: Asked, *, yes: bool) -> None:
    """Calculate a row, show it, ask, and record it; writes no tool, moves nothing.

    Raises:
        CalibrationError: Too few measurements count.
        ConfigError: Options are missing or do not go together, or the row is not measured so.
        DeclinedError: A person said no.
        NotAllowedError: The person is an operator.
    """
    known_mm = _checked(row, asked)
    job = tr("record a row of the budget")
    with open_controller(context, changes=True, job=job) as controller:
        if row == "tip_image_px":
            found = _tip_image(controller, context, asked)
        elif asked.study is not None:
            found = _study(asked.study, asked.station)
        else:
            assert known_mm is not None  # noqa: S101 - it was checked
            found = _artefact(controller, asked, known_mm)
        _show(found)
        agree(tr("Use this from now on?"), yes=yes)
        require_engineer(
            controller.outcomes,
            job,
            row=found.row,
            half_width=found.half_width,
        )
        controller.outcomes.append(measured_entry(found))
    emit("cell-accuracy-row", row_payload(found), lambda: note(tr("It is on record.")))


def row_payload(found: MeasuredRow) -> dict[str, object]:
    """Return a measured row for a document."""
    return {
        **json_fields(found, "row", "half_width"),
        "unit": ACCURACY_ROWS[found.row].unit,
        "by": found.by,
        "station": found.station or None,
        **json_fields(found, "count", "records"),
        **found.details,
    }


def _checked(row: str, asked: Asked) -> tuple[float, float] | None:
    """Return the true place of the gauge tip, ``None`` if none is used.

    Raises:
        ConfigError: See :func:`measure_row`.
    """
    if row not in ("touch_mm", "tip_image_px"):
        raise ConfigError(
            tr("{row} is not measured by this command.", row=row),
            remedy=measuring_step(row, station=asked.station, tool=asked.tool),
        )
    touching = asked.true is not None or asked.true_sigma_mm is not None
    if row == "tip_image_px":
        if touching or asked.study is not None or not asked.station:
            raise ConfigError(
                tr("tip_image_px is measured by one camera."),
                remedy=tr("Name the camera with --station; --true and --study belong to touch_mm."),
            )
        return None
    if asked.study is not None:
        if touching or asked.tool is not None or asked.nozzle or asked.since is not None:
            raise ConfigError(
                tr("A gauge study takes all values from its file."),
                remedy=tr("Leave --tool, --true, --nozzle and --since out."),
            )
        return None
    if asked.true is None or asked.tool is None:
        raise ConfigError(
            tr("touch_mm needs a gauge tip with a known offset, or a gauge study."),
            remedy=measuring_step(row, station=asked.station, tool=asked.tool),
        )
    return _two(asked.true)


def _artefact(controller: Controller, asked: Asked, known_mm: tuple[float, float]) -> MeasuredRow:
    tips = _tips(controller, asked, by_camera=False)
    show_tips(tips, known_mm)
    sigma_mm = asked.true_sigma_mm or 0.0
    return artefact_row(tips, known_mm, known_u_mm=sigma_mm, station=asked.station)


def _study(file: Path, station: str) -> MeasuredRow:
    values = study_values(load(file))
    return study_row(gauge_study(values), persons=len(values[0]), station=station)


def _tip_image(controller: Controller, context: CliContext, asked: Asked) -> MeasuredRow:
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    camera = find_station(context.cell, entries, asked.station, kind=StationKind.CAMERA)
    pixel_mm = mm_per_px(camera)
    if pixel_mm is None:
        raise ConfigError(
            tr("The pixel scale of {station} is not known.", station=asked.station),
            remedy=measuring_step("camera_scale_percent", station=asked.station, tool=asked.tool),
        )
    pairs = turned_pairs(_tips(controller, asked, by_camera=True))
    show_tips([tip for pair in pairs for tip in pair])
    note(tr("Between its two measurements, turn each nozzle by half a turn in its mount."))
    return tip_image_row(pairs, mm_per_px=pixel_mm, station=asked.station)


def _tips(controller: Controller, asked: Asked, *, by_camera: bool) -> Sequence[MeasuredTip]:
    """Return the measurements that count, oldest first."""
    entries = controller.outcomes.recorded(kinds=(EntryKind.CALIBRATION,))
    found = [
        tip
        for tip in measured_tips(entries)
        if tip.by_camera is by_camera
        and tip.at >= asked.begin
        and asked.tool in (None, tip.tool)
        and asked.station in ("", tip.station)
        and asked.nozzle in ("", tip.nozzle)
    ]
    return found[::-1]


def _show(found: MeasuredRow) -> None:
    row = ACCURACY_ROWS[found.row]
    note(
        tr(
            "{title}: half width {half_width:.4f} {unit}, by {how} of {count}.",
            title=spoken(row.title),
            half_width=found.half_width,
            unit=row.unit,
            how=found.how,
            count=found.count,
        )
    )
    note(tr("The default is {default:g} {unit}.", default=row.default, unit=row.unit))


def _two(text: str) -> tuple[float, float]:
    try:
        x_mm, y_mm = (decimal(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise _no_place(text) from error
    if not (isfinite(x_mm) and isfinite(y_mm)):
        raise _no_place(text)
    return x_mm, y_mm


def _no_place(text: str) -> ConfigError:
    return ConfigError(
        tr("{text!r} is not an offset.", text=text),
        remedy=tr("Write X,Y in mm, for example --true 12.000,-4.000."),
    )
