"""jog: small steps, in low power, inside a box."""

import click

from robolink.messages import tr
from robolink_cli._consent import agree_to_motion, dry_run_option, yes_option
from robolink_cli._context import CliContext, controller_options, open_controller
from robolink_cli._render import say


@click.command()
@click.argument("steps", nargs=-1)
@click.option("--speed", "speed_mm_s", type=click.FloatRange(1, 100), default=20.0, metavar="MM_S")
@click.option(
    "--box",
    "box_mm",
    type=click.FloatRange(min=0, min_open=True),
    default=50.0,
    metavar="MM",
    help="How far from the start the tool may be jogged, in every direction.",
)
@controller_options
@dry_run_option
@yes_option
def jog(
    context: CliContext,
    steps: tuple[str, ...],
    speed_mm_s: float,
    box_mm: float,
    dry_run: bool,
    yes: bool,
) -> None:
    """Move the tool in force by STEPS such as x+0.1 z-0.5 u+5; without STEPS, ask for them.

    Each step is one move in Power Low of at most 5 mm or 5 degrees. Negative numbers need no
    quoting: write x-0.1.
    """
    from robolink_cli._jogging import jog_by_steps, jog_on_terminal, plan_jog
    from robolink_cli._tables import show_pose
    from robolink_cli._views import pose_payload

    with open_controller(context) as controller:
        if dry_run:
            context.show_requests(plan_jog(controller, " ".join(steps), speed_mm_s, box_mm))
            return
        tool = controller.tools.selected()
        agree_to_motion(
            tr(
                "Robot {robot} will move in Power Low, at most {speed:g} mm/s, with tool {tool}, "
                "within {box:g} mm. Is the cell clear?",
                robot=controller.robot_number(),
                speed=speed_mm_s,
                tool=tool,
                box=box_mm,
            ),
            yes=yes,
        )
        with controller.preserved(tr("jog")):
            if steps:
                pose = jog_by_steps(controller, " ".join(steps), speed_mm_s, box_mm)
            else:
                pose = jog_on_terminal(controller, speed_mm_s, box_mm, say)
    payload = pose_payload(pose)
    context.emit("jog", payload, lambda: show_pose(payload))
