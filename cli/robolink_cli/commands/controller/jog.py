"""jog: small steps, in low power, inside a box."""

from typing import TYPE_CHECKING, Final

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.tolerance import may_be_guided
from robolink_cli.options.consent import dry_run_option, plain_option, yes_option
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.guidance import guided_if_alone
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.opening import open_controller

if TYPE_CHECKING:
    from robolink.model import Pose

_CELL_KEYS: Final = {"speed_mm_s": "speed_mm_s", "box_mm": "jog_box_mm"}
"""Option to key in the cell file: a box for calibrating is too wide for jogging."""


@click.command()
@click.argument("steps", nargs=-1)
@click.option(
    "--speed",
    "speed_mm_s",
    type=NumberInside(1, 100),
    default=20.0,
    metavar="MM_S",
    help="Speed of straight moves, in Power Low.",
)
@click.option(
    "--box",
    "box_mm",
    type=NumberInside(min=0, min_open=True),
    default=50.0,
    metavar="MM",
    help="How far from the start the tool may be jogged, in every direction.",
)
@click.option(
    "--keys",
    is_flag=True,
    help=declared("Jog by single keys on a full screen; on a terminal only."),
)
@controller_options
@dry_run_option
@yes_option
@plain_option
def jog(
    context: CliContext,
    steps: tuple[str, ...],
    speed_mm_s: float,
    box_mm: float,
    keys: bool,
    dry_run: bool,
    yes: bool,
) -> None:
    """Move the selected tool by STEPS such as x+0.1 z-0.5 u+5; without STEPS, ask for them.

    Each step is one move in Power Low of at most 5 mm or 5 degrees. Negative numbers need no
    quoting: write x-0.1.

    With --keys each key press is one step: arrows X and Y, PageUp and PageDown Z, Home and End U,
    or the same places of the keypad; + and - the step size (0.01, 0.1, 0.5, 1, 5). What is
    pressed while the robot moves is dropped, so that a key that is held down ends with its
    release. Space, 0 and Esc stop the step under way, and leave when the robot stands still. None
    of them is an emergency stop.
    """
    from robolink.runner import parse_steps
    from robolink_cli.views.documents import pose_payload
    from robolink_cli.views.tables import show_pose

    if keys:
        _require_keys(steps, dry_run=dry_run)
    if steps:
        parse_steps(" ".join(steps))  # a slip of the fingers is told before anything is asked
    typed = {"speed_mm_s": speed_mm_s, "box_mm": box_mm}
    speed_mm_s, box_mm = with_cell_limits(context.cell, typed, _CELL_KEYS).values()
    line = " ".join(steps)

    def work() -> "Pose | None":
        return _jogged(context, line, speed_mm_s, box_mm, dry_run=dry_run, yes=yes)

    pose = guided_if_alone(context, work, job=tr("Jog"), alone=keys)
    if pose is not None:
        payload = pose_payload(pose)
        context.emit("jog", payload, lambda: show_pose(payload))


def _jogged(
    context: CliContext,
    steps: str,
    speed_mm_s: float,
    box_mm: float,
    *,
    dry_run: bool,
    yes: bool,
) -> "Pose | None":
    """Jog, and return where the tool is then; ``None`` where requests were only shown."""
    from robolink_cli.prompts.jogging import jog_by_hand, jog_by_steps, plan_jog

    with open_controller(context) as controller:
        if dry_run:
            context.show_requests(plan_jog(controller, steps, speed_mm_s, box_mm))
            return None
        question = motion_question(
            controller,
            tr("with tool {tool}", tool=controller.tools.selected()),
            speed_mm_s=speed_mm_s,
            box_mm=box_mm,
        )
        agree_to_motion(question, yes=yes)
        with controller.preserved(tr("jog")):
            if steps:
                return jog_by_steps(controller, steps, speed_mm_s, box_mm)
            return jog_by_hand(controller, speed_mm_s, box_mm)


def _require_keys(steps: tuple[str, ...], *, dry_run: bool) -> None:
    """Refuse keys where there are none, or where what is to be done is known before.

    Raises:
        ConfigError: There is no terminal; or steps or a dry run were asked for besides.
    """
    if steps or dry_run:
        raise ConfigError(
            tr("With --keys the steps are known only when they are pressed."),
            remedy=tr("Leave --keys out to give steps, or to see their requests."),
        )
    if not may_be_guided():
        raise ConfigError(
            tr("This window cannot read single keys. Type steps instead."),
            remedy=tr("Run it on a terminal, or type steps: robolink robot jog x+0.1"),
        )
