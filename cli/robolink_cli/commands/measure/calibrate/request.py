"""What one calibration was asked for, whatever the method, and its two kinds."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Final

import click
from click.core import ParameterSource

from robolink.config import USUAL_CHANGE_MM
from robolink.errors import ConfigError, ReservedToolError, ToolIndexError
from robolink.messages import tr
from robolink.model import Controller, EntryKind
from robolink.stations import (
    Station,
    StationKind,
    find_station,
    find_stations,
    require_base_of,
)
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import note
from robolink_cli.options.consent import DryRun, MotionOption, Plain, Yes
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.impact import ImpactFile, ImpactPoints, ImpactRequest, impact_request
from robolink_cli.options.report import ForceReport, ReportPath, ReportRequest, report_request
from robolink_cli.session.completion import complete_tool
from robolink_cli.session.context import CliContext
from robolink_cli.session.operator_identity import Lot, Nozzle
from robolink_cli.session.order import OrderId, require_no_dry_run

if TYPE_CHECKING:
    from robolink.calibration import RowFact
    from robolink.calibration_run import AcceptanceCriteria, ChangePlan, Limits, ToolPlan
    from robolink.methods import LengthRule
    from robolink.procedures import TipSource


LENGTH: Final = NumberInside(min=0, min_open=True)


@dataclass(frozen=True, slots=True)
class CalibrationRequest:
    """One calibration of one tool, whatever the method.

    Attributes:
        context: What the command was told about controller, person and nozzle.
        tool: Number of the tool.
        criteria: Acceptance limits of a measurement.
        limits: Where and how fast the robot may go.
        verify: Whether to test the new tip after the write.
        assist: A simulator's stand-in for the person.
        impact: Taught points on which the change is judged.
        report: Where a page about it is wanted.
        dry_run: Whether it is only looked at.
        yes: Whether questions are answered in advance.
        pin: Name of the pin that is touched; empty where nobody named one.
        finds_pin: Whether the method finds the pin itself, so that it need not be known.
        length: What is done where the touches show that the tip is longer or shorter.
        method: Name of the method.
        station: Name of the station on whose record the measurement rests; empty for none.
        order: Id of the line computer's order; ``None`` without one.
    """

    context: CliContext
    tool: int
    criteria: "AcceptanceCriteria"
    limits: "Limits"
    verify: bool
    assist: str | None
    impact: ImpactRequest | None
    report: ReportRequest | None
    dry_run: bool
    yes: bool
    pin: str = ""
    finds_pin: bool = True
    length: "LengthRule" = "ask"
    method: str = ""
    station: str = ""
    order: str | None = None

    def at(self, station: str) -> "CalibrationRequest":
        """Return the same at a station of that name, which is recorded."""
        return replace(self, context=self.context._replace(station=station))

    def at_pin(self, station: str | None, *, finds_pin: bool = True) -> "CalibrationRequest":
        """Return the same at a pin, whose place is kept for one touch later.

        Args:
            station: Its name, ``None`` when nobody named it.
            finds_pin: Whether the method finds the pin itself.
        """
        return replace(self.at(station or ""), pin=station or "", finds_pin=finds_pin)

    def require_something_to_show(self) -> None:
        """Refuse a dry run that would show what only a measurement can give.

        Raises:
            ConfigError: An impact or a report is wanted.
        """
        if self.dry_run:
            _refuse_to_show_nothing(self.impact, self.report)

    def plan(self, source: "TipSource", controller: "Controller") -> "ChangePlan":
        """Return the plan for the measurements of ``source``."""
        from robolink.calibration_run import ChangePlan
        from robolink.model import AnsweredBy

        one = self.tool_plan(source, controller, verify=self.verify)
        return ChangePlan(
            (one,),
            limits=self.limits,
            ask_before_write=not self.yes,
            agreed_by=AnsweredBy.YES,
        )

    def _stated(self) -> "Station | None":
        """Return the station in the cell file, if there is one."""
        return find_stations(self.context.cell, ()).get(self.context.station)

    def _rows(self, controller: "Controller") -> "dict[str, RowFact]":
        """Return the rows of the budget that the cell file states."""
        from robolink.accuracy import stated_rows

        cell, name = self.context.cell, self.context.station
        entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,)) if name else ()
        return stated_rows(cell, find_stations(cell, entries).get(name, name))

    def tool_plan(
        self, source: "TipSource", controller: "Controller", *, verify: bool
    ) -> "ToolPlan":
        """Return the plan for the tool.

        Args:
            source: Where its measurement comes from.
            controller: The controller, whose record tells of the station.
            verify: Whether the new tip is tested after the write.
        """
        from robolink.calibration_run import ToolPlan

        stated = self._stated()
        return ToolPlan(
            self.tool,
            source,
            self.criteria,
            verify=verify,
            pin=self.pin,
            stated_pin=stated if self.pin else None,
            gauge=None if stated is None else stated.gauge_on_record(),
            method=self.method,
            length=self.length,
            station=self.station,
            at=self.context.station,
            rows=self._rows(controller),
        )


def request_from(
    context: CliContext,
    *,
    tool: Annotated[
        int, CliOption(shell_complete=complete_tool, help="Number of the tool, 1 to 15.")
    ],
    speed_mm_s: Annotated[
        float,
        NumberInside(1, 100),
        CliOption(
            cls=MotionOption, show_default=False, help="Speed of straight moves, in Power Low."
        ),
    ] = 20.0,
    box_mm: Annotated[
        float,
        NumberInside(min=1),
        CliOption(
            cls=MotionOption, help="How far the flange may move sideways from its present place."
        ),
    ] = 150.0,
    max_change_mm: Annotated[
        float,
        LENGTH,
        CliOption(
            help="Largest accepted change of the stored offset; more than the cell allows "
            "needs an engineer."
        ),
    ] = USUAL_CHANGE_MM,
    rms_mm: Annotated[
        float | None,
        LENGTH,
        CliOption("--max-rms", help="Largest accepted rms of the residuals."),
    ] = None,
    residual_mm: Annotated[
        float | None,
        LENGTH,
        CliOption("--max-residual", help="Largest accepted residual of one pose."),
    ] = None,
    interval_mm: Annotated[
        float | None,
        LENGTH,
        CliOption(
            "--max-interval", help="Refuse results that are not accurate to this or better (95 %)."
        ),
    ] = None,
    tolerance_mm: Annotated[
        float, LENGTH, CliOption(cls=MotionOption, help="Largest drift that passes the turn test.")
    ] = 0.2,
    no_verify: Annotated[bool, CliOption(cls=MotionOption, help="Skip the turn test.")] = False,
    assist: Annotated[
        str | None,
        CliOption(
            cls=MotionOption,
            metavar="URL",
            help="A simulator's assist or sim URL: its simulated operator jogs the tip "
            "onto the pin.",
        ),
    ] = None,
    impact: ImpactPoints = None,
    impact_pts: ImpactFile = None,
    report_path: ReportPath = None,
    force: ForceReport = False,
    nozzle: Nozzle = None,
    lot: Lot = None,
    order: OrderId = None,
    _plain: Plain = False,
    yes: Yes = False,
    dry_run: DryRun = False,
) -> CalibrationRequest:
    """Return the request that the options of a command describe.

    A larger ``max_change_mm`` than the cell's own takes an engineer: the nozzle change heeds the
    limits of its controller.

    Raises:
        ReservedToolError, ToolIndexError: There is no such tool to calibrate.
        ConfigError: Options exclude each other, or the report cannot be written.
    """
    from robolink.calibration_run import AcceptanceCriteria, Limits, usual_box

    _require_tool(tool)
    require_no_dry_run(order, dry_run=dry_run)
    criteria = AcceptanceCriteria(
        max_change_mm=max_change_mm if context.cell else min(max_change_mm, USUAL_CHANGE_MM),
        accepted_change_mm=max_change_mm,
        accepted_with="--max-change",
        rms_mm=rms_mm,
        max_residual_mm=residual_mm,
        interval_mm=interval_mm,
        drift_tolerance_mm=tolerance_mm,
        unattended=yes,
        stated=_stated_limits(),
    )
    return CalibrationRequest(
        context.with_nozzle(nozzle, lot),
        tool,
        criteria,
        Limits(usual_box(box_mm), speed_mm_s=speed_mm_s),
        verify=not no_verify,
        assist=assist,
        impact=impact_request(impact, impact_pts, names=("--impact", "--impact-pts")),
        report=report_request(report_path, force=force),
        dry_run=dry_run,
        yes=yes,
        order=order,
    )


def _stated_limits() -> frozenset[str]:
    """Return which limits of the fit were typed; the others are those of the cell."""
    context = click.get_current_context()
    names = {"rms_mm": "rms_mm", "residual_mm": "max_residual_mm", "interval_mm": "interval_mm"}
    typed = ParameterSource.COMMANDLINE
    return frozenset(
        limit for name, limit in names.items() if context.get_parameter_source(name) is typed
    )


def _require_tool(tool: int) -> None:
    if tool == 0:
        raise ReservedToolError(
            tr("Tool 0 is the flange itself and is never written."),
            remedy=tr("Choose a tool from 1 to 15."),
        )
    if not 1 <= tool <= 15:
        raise ToolIndexError(
            tr("There is no tool {tool}.", tool=tool),
            remedy=tr("Choose a tool from 1 to 15."),
        )


def _refuse_to_show_nothing(impact: ImpactRequest | None, report: ReportRequest | None) -> None:
    """Refuse a dry run that would show what only a measurement can give."""
    given = "--impact" if impact is not None else "--report" if report is not None else None
    if given is not None:
        raise ConfigError(
            tr("A dry run measures nothing, so it has nothing to show or report."),
            remedy=tr(
                "Leave out {option}, or use 'robolink tool impact' with an offset.", option=given
            ),
        )


def station_at(
    frame: CalibrationRequest, controller: Controller, kind: StationKind, *, stated: bool = False
) -> Station:
    """Return the station of the request, and show what a person must know about it.

    Args:
        frame: What was asked for.
        controller: The controller, connected.
        kind: What it has to be.
        stated: Whether the command says where it is, whatever is on record.

    Raises:
        ConfigError: There is none of that name, or it is something else.
        NotReadyError: It was learnt in another base.
    """
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    station = find_station(frame.context.cell, entries, frame.context.station, kind=kind)
    if not stated:
        require_base_of(controller, station)
    remark = station.remark()
    if remark:
        note(tr("Warning: {remark}", remark=remark))
    return station


def remark_on_pin(frame: CalibrationRequest, controller: Controller) -> None:
    """Show what a person must know about the pin that a calibration names.

    A name that nobody knows yet is no mistake: the calibration finds the pin.

    Raises:
        ConfigError: The station of that name is no pin.
        NotReadyError: It was learnt in another base.
    """
    if not frame.pin or not frame.finds_pin:
        return
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    if frame.pin in find_stations(frame.context.cell, entries):
        station_at(frame, controller, StationKind.PIN)
    else:
        note(
            tr(
                "Station {station} is not known yet: run a full calibration there to find it.",
                station=frame.pin,
            )
        )
