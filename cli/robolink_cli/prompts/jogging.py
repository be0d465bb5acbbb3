"""Jogging through the runner, so that its limits and its watch hold."""

from robolink.messages import tr
from robolink.model import Controller, MotionProfile, Pose, WorkBox
from robolink.runner import JogRange, Operator, Runner, RunSettings, ask_for_pose, jog_target
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


def _runner(controller: Controller, operator: Operator, settings: RunSettings) -> Runner:
    return Runner(controller, controller.groups[0], operator, settings)


def _settings(start: Pose, speed_mm_s: float, box_mm: float) -> RunSettings:
    box = WorkBox.around(start, xy_mm=box_mm, below_mm=box_mm, above_mm=box_mm)
    return RunSettings(box, speed_mm_s=speed_mm_s)
