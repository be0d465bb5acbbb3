"""jog: small steps, in low power, inside a box."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.person import may_be_guided
from robolink_cli.console.render import emit, show_requests
from robolink_cli.options.consent import DryRun, Plain, Yes
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options, guided_if_alone
from robolink_cli.session.motion_consent import agree_to_motion, motion_question

if TYPE_CHECKING:
    from robolink.model import Pose

_CELL_KEYS: Final = {
    "speed_mm_s": "speed_mm_s",
    "box_mm": "jog_box_mm",
    "lift_mm": "lift_mm",
}
"""Keys of the cell file by option. The box has a separate key, because one for calibrating is too
wide for jogging.
"""


@click.command()
@controller_options
def jog(
    context: CliContext,
    *,
    steps: Annotated[tuple[str, ...], CliArgument()] = (),
    speed_mm_s: Annotated[
        float,
        NumberInside(1, 100),
        CliOption(help="Speed of straight moves, in Power Low.", show_default=False),
    ] = 20.0,
    box_mm: Annotated[
        float,
        NumberInside(min=0, min_open=True),
        CliOption(
            help="How far from the start you may jog the tool, in every direction.",
            show_default=False,
        ),
    ] = 50.0,
    turn_deg: Annotated[
        float | None,
        CliOption(
            help="Turn U by this much, also by more than 5 degrees: lifts first, checks "
            "the whole turn, turns, stays lifted."
        ),
    ] = None,
    lift_mm: Annotated[
        float, NumberInside(1, 100), CliOption(help="How far to lift the tip before the turn.")
    ] = 10.0,
    tip: Annotated[
        int | None,
        click.IntRange(1, 15),
        CliOption(
            help="For a turn with tool 0: the tool whose tip swings round; default: all "
            "defined tools."
        ),
    ] = None,
    keys: Annotated[
        bool, CliOption(help="Jog with single keys on a full screen; needs a terminal.")
    ] = False,
    dry_run: DryRun = False,
    yes: Yes = False,
    _plain: Plain = False,
) -> None:
    """Move the selected tool by STEPS such as x+0.1 z-0.5 u+5; without STEPS, it asks for them.

    Each step is one move in Power Low of at most 5 mm or 5 degrees. Negative numbers need no
    quotes: write x-0.1.

    With --turn 180 it lifts the tool, turns U by 180 degrees, and stays lifted. With a tool
    selected it turns about the tip and the flange swings; with tool 0 the tip swings.

    With --keys each key press is one step: arrows X and Y, PageUp and PageDown Z, Home and End U,
    or the same places of the keypad; + and - the step size (0.01, 0.1, 0.5, 1, 5). Keys pressed
    while the robot moves are ignored, so it stops when you release a key. Space, 0 and Esc stop the
    present step, or leave when the robot does not move. None of them is an emergency stop.
    """
    from robolink.runner import parse_steps
    from robolink_cli.views.documents import pose_payload, show_pose

    if keys:
        _require_keys(steps, dry_run=dry_run)
    _require_one(steps, turn_deg, keys=keys)
    if steps:
        parse_steps(" ".join(steps))  # typing errors are reported before any question
    typed = {"speed_mm_s": speed_mm_s, "box_mm": box_mm, "lift_mm": lift_mm}
    speed_mm_s, box_mm, lift_mm = with_cell_limits(context.cell, typed, _CELL_KEYS).values()
    line = " ".join(steps)

    def work() -> "Pose | None":
        if turn_deg is not None:
            turning = _Turning(turn_deg, lift_mm, tip, speed_mm_s=speed_mm_s, box_mm=box_mm)
            return turning.done(context, dry_run=dry_run, yes=yes)
        return _jogged(context, line, speed_mm_s, box_mm, dry_run=dry_run, yes=yes)

    pose = guided_if_alone(context, work, job=tr("Jog"), alone=keys)
    if pose is not None:
        payload = pose_payload(pose)
        emit("jog", payload, lambda: show_pose(payload))


def _jogged(
    context: CliContext,
    steps: str,
    speed_mm_s: float,
    box_mm: float,
    *,
    dry_run: bool,
    yes: bool,
) -> "Pose | None":
    """Jog, and return where the tool is then; ``None`` if requests were only shown."""
    from robolink_cli.prompts.jog_keys import jog_by_hand, jog_by_steps, plan_jog

    with open_controller(context) as controller:
        if dry_run:
            show_requests(plan_jog(controller, steps, speed_mm_s, box_mm))
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


@dataclass(frozen=True, slots=True)
class _Turning:
    """A turn in the air, as requested."""

    turn_deg: float
    lift_mm: float
    tip: int | None
    speed_mm_s: float
    box_mm: float

    def done(self, context: CliContext, *, dry_run: bool, yes: bool) -> "Pose | None":
        """Carry it out, and return where the tool is then; ``None`` if it was only shown."""
        from robolink_cli.prompts.jog_keys import plan_turn, require_turn, turn

        how = {"lift_mm": self.lift_mm, "speed_mm_s": self.speed_mm_s, "box_mm": self.box_mm}
        with open_controller(context) as controller:

            def require_inside() -> None:
                require_turn(
                    controller,
                    self.turn_deg,
                    lift_mm=self.lift_mm,
                    box_mm=self.box_mm,
                    tip=self.tip,
                )

            require_inside()
            if dry_run:
                show_requests(plan_turn(controller, self.turn_deg, **how))
                return None
            purpose = tr(
                "with tool {tool}: up by {lift:g} mm, then U by {turn:+g} degrees, and stay there",
                tool=controller.tools.selected(),
                lift=self.lift_mm,
                turn=self.turn_deg,
            )
            question = motion_question(
                controller, purpose, speed_mm_s=self.speed_mm_s, box_mm=self.box_mm
            )
            agree_to_motion(question, yes=yes)
            with controller.preserved(tr("jog")):
                require_inside()  # a person may have moved it while the question was open
                return turn(controller, self.turn_deg, **how)


def _require_one(steps: tuple[str, ...], turn_deg: float | None, *, keys: bool) -> None:
    """Refuse a turn together with steps, and options of a turn without one.

    Raises:
        ConfigError: Names what does not go together.
    """
    if turn_deg is not None and (steps or keys):
        raise ConfigError(
            tr("--turn cannot be combined with steps."),
            remedy=tr("Give --turn alone, then the steps in a second command."),
        )
    if turn_deg is not None:
        return
    given = click.get_current_context().get_parameter_source
    for name in ("lift_mm", "tip"):
        if given(name) is ParameterSource.COMMANDLINE:
            raise ConfigError(tr("--lift and --tip need --turn."), remedy=tr("Add --turn."))


def _require_keys(steps: tuple[str, ...], *, dry_run: bool) -> None:
    """Refuse keys where there are none, or where the movement is already given.

    Raises:
        ConfigError: There is no terminal; or steps or a dry run were asked for besides.
    """
    if steps or dry_run:
        raise ConfigError(
            tr("--keys cannot be combined with steps or a dry run."),
            remedy=tr("Leave out --keys to give steps, or to see their requests."),
        )
    if not may_be_guided():
        raise ConfigError(
            tr("This window cannot read single keys. Type steps instead."),
            remedy=tr("Run it on a terminal, or type steps: robolink robot jog x+0.1"),
        )
