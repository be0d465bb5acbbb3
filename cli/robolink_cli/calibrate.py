"""calibrate METHOD: measure a tool offset, propose it, write it, prove it."""

from typing import Any

import click

from robolink.messages import tr
from robolink_cli._consent import agree_to_motion, dry_run_option, yes_option
from robolink_cli._context import CliContext, controller_options, open_controller


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
    default=2.0,
    show_default=True,
    help="Largest plausible change against the stored offset.",
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
    help="A simulator's assist URL: its operator brings the tip onto the pin.",
)
@controller_options
@dry_run_option
@yes_option
def two_pose(
    context: CliContext,
    *,
    tool: int,
    assist: str | None,
    dry_run: bool,
    yes: bool,
    **limits: Any,  # noqa: ANN401 - click passes the options by name
) -> None:
    """Touch one pin at two angles of U, half a turn apart.

    Put the tip some millimetres above a fixed pin first. The robot moves in Power Low only:
    it lifts before it turns and comes down to a clearance; you do the rest by typing steps.
    """
    from robolink_cli._calibrating import Bench, plan_from, show_plan

    plan = plan_from(tool, **limits)
    with open_controller(context) as controller:
        bench = Bench(controller, plan, assist_url=assist)
        if dry_run:
            payload = bench.dry_run()
            context.emit("dry-run", payload, lambda: show_plan(payload))
            return
        bench.require_writable()
        agree_to_motion(
            tr(
                "Robot {robot} will move in Power Low, at most {speed:g} mm/s, within {box:g} mm, "
                "to measure tool {tool}. Is the cell clear?",
                robot=controller.robot_number(),
                speed=plan.speed_mm_s,
                box=plan.box_mm,
                tool=tool,
            ),
            yes=yes,
        )
        payload = bench.run(ask_before_write=not yes)
    context.emit("calibration", payload, bench.show_end)
