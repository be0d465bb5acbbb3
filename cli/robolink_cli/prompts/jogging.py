"""Jogging through the runner, so that its limits and its watch hold."""

from dataclasses import replace

from robolink.messages import tr
from robolink.model import Controller, MotionProfile, Pose, WorkBox
from robolink.runner import Operator, Runner, RunSettings, ask_for_pose, jog_target
from robolink_cli.console.render import say
from robolink_cli.prompts.key_jog import KeyOperator
from robolink_cli.prompts.keyboard import Keyboard
from robolink_cli.prompts.operator import TerminalOperator, terminal


def jog_by_steps(controller: Controller, steps: str, speed_mm_s: float, box_mm: float) -> Pose:
    """Make one move of ``steps`` and return where the tool is then."""
    return _runner(controller, TerminalOperator(say), speed_mm_s, box_mm).jog(steps)


def jog_on_terminal(controller: Controller, speed_mm_s: float, box_mm: float) -> Pose:
    """Let a person jog until an empty line, and return where the tool is then."""
    runner = _runner(controller, terminal(), speed_mm_s, box_mm)
    return runner.run(ask_for_pose(tr("Jog the tool.")))


def jog_by_keys(controller: Controller, keys: Keyboard, speed_mm_s: float, box_mm: float) -> Pose:
    """Let a person jog by keys until q or ENTER, and return where the tool is then."""
    group = controller.groups[0]
    # The operator of the keys shows after each step where the tool is, and the size of steps.
    settings = replace(_settings(group.pose(), speed_mm_s, box_mm), tell_jogs=False)
    operator = KeyOperator(keys, group.pose, settings.box, say)
    return Runner(controller, group, operator, settings).run(ask_for_pose(tr("Jog the tool.")))


def plan_jog(controller: Controller, steps: str, speed_mm_s: float, box_mm: float) -> list[str]:
    """Return the requests that :func:`jog_by_steps` would send; refuse what it would refuse."""
    group = controller.groups[0]
    settings = _settings(group.pose(), speed_mm_s, box_mm)
    target, path = jog_target(group.pose(), steps, settings)
    settings.box.check(target)
    profile = MotionProfile(path, settings.speed_percent, settings.speed_mm_s)
    return list(group.requests_for(target, profile))


def _runner(controller: Controller, operator: Operator, speed_mm_s: float, box_mm: float) -> Runner:
    group = controller.groups[0]
    return Runner(controller, group, operator, _settings(group.pose(), speed_mm_s, box_mm))


def _settings(start: Pose, speed_mm_s: float, box_mm: float) -> RunSettings:
    box = WorkBox.around(start, xy_mm=box_mm, below_mm=box_mm, above_mm=box_mm)
    return RunSettings(box, speed_mm_s=speed_mm_s)
