"""A cell's knowledge of its accuracy, as ``cell accuracy`` shows it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robolink.accuracy import (
    CellRecord,
    KnownRow,
    MeasuredTip,
    RowsAt,
    measuring_step,
    rows_of_cell,
)
from robolink.calibration import ACCURACY_ROWS
from robolink.messages import spoken, tr
from robolink.model import EntryKind, Recorded
from robolink.timing import local_label
from robolink_cli.console.render import say, table
from robolink_cli.session.context import CliContext
from robolink_cli.views.stations import records_of_robots

_KINDS = (EntryKind.STATION, EntryKind.CALIBRATION, EntryKind.ACCURACY)


@dataclass(frozen=True, slots=True)
class RowsOfRobot:
    """The rows at one place, and whose they are.

    Attributes:
        place: The rows.
        robot: Name of the robot; empty where there is one.
    """

    place: RowsAt
    robot: str = ""


def known_rows(context: CliContext, *, robot: str | None = None) -> list[RowsOfRobot]:
    """Return the rows in cell file and journal, without asking the controller.

    Args:
        context: The command.
        robot: The robot that is meant, ``None`` for all.

    Raises:
        ConfigError: No controller is named, there is no such robot, or the journal cannot be read.
    """
    records = records_of_robots(context, robot, kinds=_KINDS, nobodys=False)
    return [
        RowsOfRobot(place, name if len(records) > 1 else "")
        for name, entries in records
        for place in rows_of_cell(context.cell, _record_of(entries))
    ]


def _record_of(entries: Sequence[Recorded]) -> CellRecord:
    return CellRecord(lambda *, kinds: (one for one in entries if one.kind in kinds))


def accuracy_payload(context: CliContext, known: Sequence[RowsOfRobot]) -> dict[str, Any]:
    """Return the rows for a document."""
    return {
        "cell": None if context.cell is None else context.cell.name,
        "places": [_place_payload(one) for one in known],
        "defaults": sum(row.fact.basis == "default" for one in known for row in one.place.rows),
    }


def _place_payload(one: RowsOfRobot) -> dict[str, Any]:
    place = one.place
    station = place.station
    return {
        "station": None if station is None else station.id,
        "kind": None if station is None else station.kind.value,
        "robot": one.robot or None,
        "methods": list(place.methods),
        "learnt_at": None if station is None else station.found_at or None,
        "age_months": place.months,
        "rows": [_row_payload(place, row) for row in place.rows],
    }


def _row_payload(place: RowsAt, row: KnownRow) -> dict[str, Any]:
    kind, beside = ACCURACY_ROWS[row.key], row.on_record
    return {
        "row": row.key,
        "title": spoken(kind.title),
        "half_width": row.half_width,
        "of_which_age": row.fact.growth,
        "unit": kind.unit,
        "basis": row.fact.basis,
        "told": row.fact.told or None,
        "alone_mm": place.alone_mm(row),
        "on_record": None if beside is None else beside.half_width,
        "measure": _step(place, row) if row.fact.basis == "default" else None,
    }


def show_accuracy(known: Sequence[RowsOfRobot]) -> None:
    """Print the rows, place by place, and below them how to measure each default."""
    steps: dict[str, None] = {}
    for one in known:
        place = one.place
        columns = (tr("row"), tr("half width"), tr("alone mm"), tr("known from"))
        table(_title(one), columns, [_cells(place, row) for row in place.rows])
        if place.methods:
            say(tr("  methods: {methods}", methods=", ".join(place.methods)))
        for row in place.rows:
            title = spoken(ACCURACY_ROWS[row.key].title)
            if row.exceeded and row.on_record is not None:
                say(
                    tr(
                        "  ! {title}: the record says {half_width:.4g} {unit}, more than is stated "
                        "({told}).",
                        title=title,
                        half_width=row.on_record.half_width,
                        unit=ACCURACY_ROWS[row.key].unit,
                        told=row.on_record.told,
                    )
                )
            if row.fact.basis == "default":
                steps[f"  {row.key}: {_step(place, row)}"] = None
    if steps:
        say(tr("Not measured and not stated yet; to do it:"))
        for step in steps:
            say(step)
    else:
        say(tr("Every row is stated or recorded."))


def _step(place: RowsAt, row: KnownRow) -> str:
    """Return how to measure a row there."""
    if place.station is None:
        return measuring_step(row.key)
    return measuring_step(row.key, station=place.station.id, kind=place.station.kind)


def _title(one: RowsOfRobot) -> str:
    place = one.place
    if place.station is None:
        title = tr("touching by eye")
    else:
        title = tr("station {id}", id=place.station.id)
    if one.robot:
        title = f"{one.robot.rpartition('/')[2]}: {title}"
    return title


def _cells(place: RowsAt, row: KnownRow) -> list[str]:
    kind, alone_mm = ACCURACY_ROWS[row.key], place.alone_mm(row)
    return [
        spoken(kind.title),
        f"{row.half_width:.4g} {kind.unit}",
        "-" if alone_mm is None else f"{alone_mm:.3f}",
        _known_from(place, row),
    ]


def _known_from(place: RowsAt, row: KnownRow) -> str:
    fact = row.fact
    said = fact.told or tr("default, not measured in this cell")
    if fact.growth and place.months is not None:
        grown = tr(
            "{growth:.3f} of it for {months:.1f} months", growth=fact.growth, months=place.months
        )
        return f"{said}; {grown}"
    return said


def show_tips(tips: Sequence[MeasuredTip], known_mm: tuple[float, float] | None = None) -> None:
    """Print the measurements behind a row, with the distance of each from the known place."""
    columns = [tr("entry"), tr("when"), tr("who"), tr("method"), tr("nozzle"), "X mm", "Y mm"]
    if known_mm is not None:
        columns += ["dX mm", "dY mm"]
    rows = []
    for tip in tips:
        beside = [f"{value:.3f}" for value in tip.xy_mm]
        if known_mm is not None:
            beside += [f"{a - b:+.3f}" for a, b in zip(tip.xy_mm, known_mm, strict=True)]
        named = [tip.person or "-", tip.method, tip.nozzle or "-"]
        rows.append([str(tip.number), local_label(tip.at), *named, *beside])
    table(tr("measurements"), columns, rows)
