"""VCal, VxCalib, and the vision project kept and taken again (docs/reference/vision.md 1, 3)."""

from collections.abc import Callable, Iterator
from typing import Final

from robolink.model import Pose
from robolink_simulators.cell.places import Pixel
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RaisedError
from robolink_simulators.epson.spel.expressions.values import as_integer
from robolink_simulators.epson.spel.line_tree import VisionStatement
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.families.vision import (
    compile_image,
    named,
    vision_of,
)
from robolink_simulators.epson.spel.tasks.compiled import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.waits import (
    Blocking,
    OneAfterAnother,
    StatementWaiting,
    TaskWaiting,
)
from robolink_simulators.epson.spel.tree import (
    Literal,
    MotionOptions,
    MotionStatement,
    PointExpression,
    PointFunction,
)

_SETTLING_NS: Final = 500_000_000
"""Between a motion and its picture: nMotionDelay of the calibrations that were seen."""

_NO_OPTIONS: Final = MotionOptions()


def _keep(emitter: Emitter, node: VisionStatement) -> Operation:  # noqa: ARG001
    return lambda t: vision_of(t).save()


def _take(emitter: Emitter, node: VisionStatement) -> Operation:  # noqa: ARG001
    return lambda t: vision_of(t).load()


def _clear_graphics(emitter: Emitter, node: VisionStatement) -> Operation:  # noqa: ARG001
    """VCls: what it clears is on a screen that is not there; the task must be one that may."""

    def go(t: SpelTask) -> None:
        vision_of(t)

    return go


def _calibrate(emitter: Emitter, node: VisionStatement) -> Operation:
    """``VCal name``: the robot goes to each taught pose, with the tool in force."""
    name = named(emitter, node.items[0])

    def go(t: SpelTask) -> TaskWaiting:
        wanted = name(t)
        return OneAfterAnother(_calibrating(t, wanted, vision_of(t).taught_poses(wanted)))

    return go


def _calibrating(t: SpelTask, name: str, poses: tuple[Pose, ...]) -> Iterator[TaskWaiting]:
    pixels, places = list[Pixel](), list[tuple[float, float]]()
    vision, machine = vision_of(t), t.session.machine
    for pose in poses:
        going = StatementWaiting(t.runner.steps.carried_out(t, _go_to(pose)))
        yield going
        if going.execution.error is not None:
            raise RaisedError(going.execution.error.number, going.execution.error.text)
        t.now_ns = max(t.now_ns, going.execution.ended_ns)
        yield Blocking(lambda: False, lambda: None, end_ns=t.now_ns + _SETTLING_NS)
        t.now_ns += _SETTLING_NS
        machine.advance(t.now_ns)
        pixels.append(vision.target())
        x_mm, y_mm, *_ = machine.here().coordinates
        places.append((x_mm, y_mm))
    vision.calibrate(name, pixels, places)


def _go_to(pose: Pose) -> MotionStatement:
    numbers = tuple(Literal(value) for value in (pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg))
    return MotionStatement("go", (PointExpression(PointFunction("xy", numbers)),), _NO_OPTIONS)


def _calibrate_image(emitter: Emitter, node: VisionStatement) -> Operation:
    """``VxCalib number, mounting, P(a:b), P(c:d)``: pixels, and the places where they were."""
    number, mounting = (emitter.run(item) for item in node.items)
    ends = [(emitter.run(one.first), emitter.run(one.last)) for one in node.ranges]

    def points(t: SpelTask, which: int) -> list[Point]:
        first, last = (as_integer(run(t)) for run in ends[which])
        table = t.session.machine.points
        return [table.get(at) for at in range(first, last + 1)]

    def go(t: SpelTask) -> None:
        calibrations = t.session.machine.image_calibrations
        given = points(t, 0), points(t, 1)
        calibrations.define(as_integer(number(t)), as_integer(mounting(t)), *given)

    return go


VISION_STATEMENTS: Final[dict[str, Callable[[Emitter, VisionStatement], Operation]]] = {
    "vsave": _keep,
    "vload": _take,
    "vcls": _clear_graphics,
    "vcal": _calibrate,
    "vsaveimage": compile_image,
    "vxcalib": _calibrate_image,
}
"""Statements about the vision project and its calibrations."""
