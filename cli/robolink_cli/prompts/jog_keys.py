"""Jogs through the runner, so that its limits and its watch apply."""

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Controller, MotionProfile, Pose, WorkBox
from robolink.procedures import require_turn_inside, turn_in_air
from robolink.runner import (
    JogRange,
    Move,
    Operator,
    Runner,
    RunSettings,
    ask_for_pose,
    jog_target,
    way_in_words,
)
from robolink_cli.console.render import say
from robolink_cli.prompts.operator import TerminalOperator, terminal


def jog_by_steps(controller: Controller, steps: str, speed_mm_s: float, box_mm: float) -> Pose:
    """Make one move of ``steps`` and return where the tool is then."""
    settings = _settings(controller.groups[0].pose(), speed_mm_s, box_mm)
    return _runner(controller, TerminalOperator(say), settings).jog(steps)


def jog_by_hand(controller: Controller, speed_mm_s: float, box_mm: float) -> Pose:
    """Let a person jog by keys or lines until they leave, and return where the tool is then."""
    start = controller.groups[0].pose()
    settings = _settings(start, speed_mm_s, box_mm)
    jog = ask_for_pose(tr("Jog the tool."), JogRange(start, settings.box))
    return _runner(controller, terminal(), settings).run(jog)


def plan_jog(controller: Controller, steps: str, speed_mm_s: float, box_mm: float) -> list[str]:
    """Return the requests that :func:`jog_by_steps` would send; refuse what it would refuse."""
    group = controller.groups[0]
    settings = _settings(group.pose(), speed_mm_s, box_mm)
    target, path = jog_target(group.pose(), steps, settings)
    settings.box.check(target)
    profile = MotionProfile(path, settings.speed_percent, settings.speed_mm_s)
    return list(group.requests_for(target, profile))


def turn(
    controller: Controller, turn_deg: float, *, lift_mm: float, speed_mm_s: float, box_mm: float
) -> Pose:
    """Lift, turn, stay there, say so, and return where the tool is then."""
    start = controller.groups[0].pose()
    settings = _settings(start, speed_mm_s, box_mm)
    operator = TerminalOperator(say)
    runner = _runner(controller, operator, settings)
    runner.run(turn_in_air(start, turn_deg, lift_mm=lift_mm))
    after = controller.groups[0].pose()
    operator.tell(way_in_words(start, after))
    operator.tell(tr("It stays lifted by {lift:g} mm. Go down in steps.", lift=lift_mm))
    return after


def plan_turn(
    controller: Controller, turn_deg: float, *, lift_mm: float, speed_mm_s: float, box_mm: float
) -> list[str]:
    """Return the requests that :func:`turn` would send."""
    group = controller.groups[0]
    start = group.pose()
    settings = _settings(start, speed_mm_s, box_mm)
    requests: list[str] = []
    for step in turn_in_air(start, turn_deg, lift_mm=lift_mm):
        assert isinstance(step, Move)  # noqa: S101 - it makes no other
        settings.box.check(step.target)
        profile = MotionProfile(step.path, settings.speed_percent, settings.speed_mm_s)
        requests += group.requests_for(step.target, profile)
    return requests


def require_turn(
    controller: Controller, turn_deg: float, *, lift_mm: float, box_mm: float, tip: int | None
) -> None:
    """Refuse a turn during which the flange or a tip leaves the area; reads only.

    Where a tool is selected, it turns about its tip, and the flange swings. Where none is, the
    tips swing: that of the tool that was named, else of all that are defined.

    Raises:
        ConfigError: The named tool is not defined, or another tool is selected.
        LimitError: Something would leave the area.
    """
    tools, group = controller.tools, controller.groups[0]
    selected = tools.selected() or 0
    if tip is not None and selected not in (0, tip):
        raise ConfigError(
            tr("Tool {selected} is selected, so it turns about that tip.", selected=selected),
            remedy=tr("Leave --tip out, or select tool 0 first."),
        )
    defined = {number: offset for number, offset in tools.read_all().items() if offset and number}
    wanted = tip or selected
    if wanted and wanted not in defined:
        raise ConfigError(
            tr("Tool {tool} is not defined.", tool=wanted),
            remedy=tr("First write the approximate place of its tip with 'robolink tool set'."),
        )
    numbers = [wanted] if wanted else sorted(defined)
    require_turn_inside(
        group.pose(),
        turn_deg,
        lift_mm=lift_mm,
        reach_mm=box_mm,
        swings={tr("tip of tool {tool}", tool=number): defined[number] for number in numbers},
        tool=defined[selected] if selected else None,
    )


def _runner(controller: Controller, operator: Operator, settings: RunSettings) -> Runner:
    return Runner(controller, controller.groups[0], operator, settings)


def _settings(start: Pose, speed_mm_s: float, box_mm: float) -> RunSettings:
    box = WorkBox.around(start, xy_mm=box_mm, below_mm=box_mm, above_mm=box_mm)
    return RunSettings(box, speed_mm_s=speed_mm_s)
