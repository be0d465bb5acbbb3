"""jog: small steps, in low power, inside a box."""

from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.options.consent import dry_run_option, yes_option
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.opening import open_controller

if TYPE_CHECKING:
    from robolink_cli.prompts.keyboard import Keyboard

_CELL_KEYS: Final = {"speed_mm_s": "speed_mm_s", "box_mm": "jog_box_mm"}
"""Option to key in the cell file: a box for calibrating is too wide for jogging."""


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
@click.option("--keys", is_flag=True, help="Jog with the arrow keys; on a terminal only.")
@controller_options
@dry_run_option
@yes_option
def jog(
    context: CliContext,
    steps: tuple[str, ...],
    speed_mm_s: float,
    box_mm: float,
    keys: bool,
    dry_run: bool,
    yes: bool,
) -> None:
    """Move the tool in force by STEPS such as x+0.1 z-0.5 u+5; without STEPS, ask for them.

    Each step is one move in Power Low of at most 5 mm or 5 degrees. Negative numbers need no
    quoting: write x-0.1.

    With --keys each key press is one step: arrows X and Y, PageUp and PageDown Z, < and > U,
    + and - the step size (0.01, 0.1, 1, 5), q or ENTER ends. Keys pressed while the robot
    moves are dropped. A step that has begun goes on when the key is released; Ctrl-C aborts
    it, and only the emergency stop is an emergency stop.
    """
    from robolink.runner import parse_steps
    from robolink_cli.prompts.jogging import jog_by_keys, jog_by_steps, jog_on_terminal, plan_jog
    from robolink_cli.prompts.key_jog import agree_by_key
    from robolink_cli.session.selected_tool import heed_selection
    from robolink_cli.views.documents import pose_payload
    from robolink_cli.views.tables import show_pose

    if steps:
        parse_steps(" ".join(steps))  # a slip of the fingers is told before anything is asked
    typed = {"speed_mm_s": speed_mm_s, "box_mm": box_mm}
    speed_mm_s, box_mm = with_cell_limits(context.cell, typed, _CELL_KEYS).values()
    with (
        _keyboard_for(keys, steps, dry_run=dry_run) as board,
        open_controller(context) as controller,
    ):
        if dry_run:
            context.show_requests(plan_jog(controller, " ".join(steps), speed_mm_s, box_mm))
            return
        question = motion_question(
            controller,
            tr("with tool {tool}", tool=controller.tools.selected()),
            speed_mm_s=speed_mm_s,
            box_mm=box_mm,
        )
        if board is None:
            agree_to_motion(question, yes=yes)
        else:
            heed_selection(controller, context.expected, yes=yes)
        if board is not None and not yes:
            agree_by_key(question, board, watch=controller.status)
        with controller.preserved(tr("jog")):
            if board is not None:
                pose = jog_by_keys(controller, board, speed_mm_s, box_mm)
            elif steps:
                pose = jog_by_steps(controller, " ".join(steps), speed_mm_s, box_mm)
            else:
                pose = jog_on_terminal(controller, speed_mm_s, box_mm)
    payload = pose_payload(pose)
    context.emit("jog", payload, lambda: show_pose(payload))


def _keyboard_for(
    keys: bool, steps: tuple[str, ...], *, dry_run: bool
) -> "AbstractContextManager[Keyboard | None]":
    """Return the terminal's keys when they are wanted.

    Raises:
        ConfigError: Steps or a dry run were asked for besides.
    """
    if not keys:
        return nullcontext()
    if steps or dry_run:
        raise ConfigError(
            tr("With --keys the steps are known only when they are pressed."),
            remedy=tr("Leave --keys out to give steps, or to see their requests."),
        )
    from robolink_cli.prompts.keyboard import keyboard

    return keyboard()
