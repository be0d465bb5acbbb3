"""calibrate METHOD: measure a tool offset, propose it, write it, prove it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli._cell import with_cell_limits
from robolink_cli._consent import agree_to_motion, dry_run_option, motion_question, yes_option
from robolink_cli._context import CliContext, controller_options, open_controller
from robolink_cli._impacting import ImpactRequest, impact_options, impact_request
from robolink_cli._people import nozzle_options
from robolink_cli._pose_source import pose_source, pose_source_options, refuse_motion_options
from robolink_cli._reporting import ReportRequest, report_options, report_request, reporting

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.nozzle_change import ChangePlan

_MOTION: Final = (
    "turn_deg",
    "lift_mm",
    "clearance_mm",
    "speed_mm_s",
    "box_mm",
    "tolerance_mm",
    "no_verify",
    "assist",
)
"""Options that mean nothing when the poses exist already."""

_USUAL_CHANGE_MM: Final = 2.0

_CELL_KEYS: Final = {
    "lift_mm": "lift_mm",
    "clearance_mm": "clearance_mm",
    "speed_mm_s": "speed_mm_s",
    "box_mm": "box_mm",
    "max_change_mm": "max_change_mm",
    "tolerance_mm": "drift_tolerance_mm",
}
"""Option to key in the cell file."""


@click.group()
def calibrate() -> None:
    """Measure where a tool's tip is, propose the offset, write it and prove it."""


@calibrate.command("two-pose")
@click.option("--tool", type=int, required=True, help="Number of the tool, 1 to 15.")
@click.option("--turn", "turn_deg", type=float, default=180.0, metavar="DEG", show_default=True)
@click.option("--lift", "lift_mm", type=click.FloatRange(1, 100), default=10.0, show_default=True)
@click.option(
    "--clearance",
    "clearance_mm",
    type=click.FloatRange(0.5, 50),
    default=2.0,
    show_default=True,
    help="How far above the pin the tip stops; the rest is yours.",
)
@click.option("--speed", "speed_mm_s", type=click.FloatRange(1, 100), default=20.0, metavar="MM_S")
@click.option(
    "--box",
    "box_mm",
    type=click.FloatRange(min=1),
    default=150.0,
    show_default=True,
    help="How far, sideways, the flange may go from where it is.",
)
@click.option(
    "--max-change",
    "max_change_mm",
    type=click.FloatRange(min=0, min_open=True),
    default=_USUAL_CHANGE_MM,
    show_default=True,
    help="Largest plausible change against the stored offset; more than the cell allows takes "
    "an engineer.",
)
@click.option(
    "--tolerance",
    "tolerance_mm",
    type=click.FloatRange(min=0, min_open=True),
    default=0.2,
    show_default=True,
    help="Largest drift about the new tip that passes.",
)
@click.option("--no-verify", is_flag=True, help="Do not turn about the new tip afterwards.")
@click.option(
    "--assist",
    metavar="URL",
    help="A simulator's assist or sim URL: its operator brings the tip onto the pin.",
)
@pose_source_options
@impact_options
@report_options
@nozzle_options
@controller_options
@dry_run_option
@yes_option
def two_pose(
    context: CliContext,
    *,
    tool: int,
    assist: str | None,
    impact: str | None,
    impact_pts: Path | None,
    report_path: Path | None,
    force: bool,
    dry_run: bool,
    yes: bool,
    points: str | None,
    typed: tuple[str, ...],
    path: Path | None,
    taught_tool: int | None,
    nozzle: str | None,
    lot: str | None,
    **limits: Any,  # noqa: ANN401 - click passes the options by name
) -> None:
    """Touch one pin at two angles of U, half a turn apart.

    Put the tip some millimetres above a fixed pin first. The robot moves in Power Low only:
    it lifts before it turns and comes down to a clearance; you do the rest by typing steps.

    With --points, --pose or --poses the two poses exist already: nothing moves, no tool is
    selected, and nothing is proved by turning about the new tip.
    """
    from robolink_cli._calibrating import plan_from
    from robolink_cli._calibrating_poses import PosesPlan, calibrate_from_poses

    plan = plan_from(
        tool,
        **with_cell_limits(context.cell, limits, _CELL_KEYS),
        jump_limit_mm=jump_limit_mm(context.cell),
    )
    judged = impact_request(impact, impact_pts, names=("--impact", "--impact-pts"))
    page = report_request(report_path, force=force)
    context = context.with_nozzle(nozzle, lot)
    source = pose_source(points=points, typed=typed, path=path, taught_tool=taught_tool)
    if source is None:
        if dry_run:
            _refuse_to_show_nothing(judged, page)
        _measure(context, plan, assist=assist, impact=judged, report=page, dry_run=dry_run, yes=yes)
    else:
        refuse_motion_options(click.get_current_context(), _MOTION)
        known = PosesPlan(tool, taught_tool or 0, plan.tools[0].gate)
        calibrate_from_poses(
            context, known, source, impact=judged, report=page, dry_run=dry_run, yes=yes
        )


def jump_limit_mm(cell: "Cell | None") -> float:
    """Return the largest change that takes no engineer: the cell's, or the usual one."""
    limit = cell.settings.max_change_mm if cell else None
    return _USUAL_CHANGE_MM if limit is None else limit


def _refuse_to_show_nothing(impact: ImpactRequest | None, report: ReportRequest | None) -> None:
    """Refuse to show in a dry run what only a measurement can give."""
    if impact is not None:
        raise ConfigError(
            tr("A dry run measures nothing, so there is no impact to show."),
            remedy=tr("Leave --impact out, or use 'robolink impact' with an offset."),
        )
    if report is not None:
        raise ConfigError(
            tr("A dry run measures nothing, so there is nothing to report."),
            remedy=tr("Leave --report out, or use 'robolink impact' with an offset."),
        )


def _measure(
    context: CliContext,
    plan: "ChangePlan",
    *,
    assist: str | None,
    impact: ImpactRequest | None,
    report: ReportRequest | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Let the robot and a person take the poses, then propose, write and verify."""
    from robolink_cli._calibrating import LiveCalibration
    from robolink_cli._calibration_views import show_plan

    with (
        open_controller(context, changes=not dry_run) as controller,
        reporting(report, controller) as draft,
    ):
        live = LiveCalibration(controller, plan, draft=draft, assist_url=assist, impact=impact)
        if dry_run:
            payload = live.dry_run()
            context.emit("dry-run", payload, lambda: show_plan(payload))
            return
        live.require_writable()
        agree_to_motion(
            motion_question(
                controller,
                tr("to measure tool {tool}", tool=live.tool),
                speed_mm_s=plan.limits.speed_mm_s,
                box_mm=plan.limits.box_mm,
            ),
            yes=yes,
        )
        payload = live.run(ask_before_write=not yes)
        # Now, because Ctrl-C may come before the logout is answered.
        live.show_end()
    context.emit("calibration", {**payload, "report": draft.saved}, lambda: None)
