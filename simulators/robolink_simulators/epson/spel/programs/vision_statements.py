"""Statements of vision: sequences, pictures and calibrations.

VRun, VGet, VSet and VSaveImage (docs/reference/vision.md 1).

VCal, VxCalib, and the vision project kept and taken again (docs/reference/vision.md 1, 3).
"""

from collections.abc import Callable, Iterator
from typing import Final

from robolink.messages import tr
from robolink.model import Pose
from robolink_simulators.cell.places import Pixel
from robolink_simulators.epson.condition import RaisedError, RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import as_integer, as_text
from robolink_simulators.epson.spel.line_tree import VisionAccess, VisionRun, VisionStatement
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.tasks.compiled_program import Operation
from robolink_simulators.epson.spel.tasks.task import SpelTask
from robolink_simulators.epson.spel.tasks.task_steps import require_unbound
from robolink_simulators.epson.spel.tasks.waits import (
    StatementWait,
    TaskWait,
    WaitSequence,
    WaitUntil,
)
from robolink_simulators.epson.spel.tree import (
    Expression,
    Literal,
    MotionOptions,
    MotionStatement,
    Name,
    PointExpression,
    PointFunction,
)
from robolink_simulators.epson.vision_project import SUFFIX
from robolink_simulators.epson.vision_system import RESULTS, VisionSystem

_NS_PER_MS = 1_000_000


def vision_of(t: SpelTask) -> VisionSystem:
    """Return the vision system that a task may use.

    Raises:
        Refusal: This kind of task may not, or the project has none.
    """
    require_unbound(t)
    vision: VisionSystem | None = t.runner.vision
    if vision is None:
        raise SpelRefusal(RefusalKind.VISION_SEQUENCE, "The project has no vision sequences")
    return vision


def _text(emitter: Emitter, part: str) -> Callable[[SpelTask], str]:
    """Return what gives a part of a path: a string variable's value, or the name itself."""
    if not part.endswith("$"):
        return lambda _: part
    run = emitter.run(Name(part))
    return lambda t: as_text(run(t))


def named(emitter: Emitter, given: Expression) -> Callable[[SpelTask], str]:
    """Return what gives the name of something of the vision project: a bare name, or a text.

    Raises:
        ProgramFault: It makes no sense.
    """
    if isinstance(given, Name) and given.arguments is None:
        return _text(emitter, given.name)
    run = emitter.run(given)
    return lambda t: as_text(run(t))


def compile_run(emitter: Emitter, node: VisionRun) -> Operation:
    """``VRun sequence``: a bare name, or a text. It goes on when the sequence is finished.

    Raises:
        ProgramFault: It makes no sense.
    """
    name = named(emitter, node.sequence)

    def go(t: SpelTask) -> WaitUntil:
        t.session.machine.advance(t.now_ns)
        took_ms = vision_of(t).run(name(t))
        return WaitUntil(lambda: False, lambda: None, end_ns=t.now_ns + took_ms * _NS_PER_MS)

    return go


def compile_access(emitter: Emitter, node: VisionAccess) -> Operation:
    """``VGet`` into variables, or ``VSet`` from a value.

    Raises:
        ProgramFault: It makes no sense.
    """
    parts = [_text(emitter, part) for part in node.path]
    if node.word == "vset":
        return _setting(emitter, node, parts)
    index = None if node.index is None else emitter.run(node.index)
    count = RESULTS.get(node.path[-1], 1) if len(parts) > 2 else 1
    if len(node.items) != count:
        name = node.path[-1]
        raise emitter.fault(tr("{name} fills {count} variables", name=name, count=count))
    targets = [emitter.variable_for(item) for item in node.items]

    def go(t: SpelTask) -> None:
        path = tuple(part(t) for part in parts)
        wanted = None if index is None else as_integer(index(t))
        for value, target in zip(vision_of(t).get(path, wanted), targets, strict=True):
            if value is not None:
                variable = target(t)
                variable.values[0] = variable.kind.store(value)

    return go


def compile_image(emitter: Emitter, node: VisionStatement) -> Operation:
    """``VSaveImage sequence, file``: the picture of the last run, into the controller's folder.

    Raises:
        ProgramFault: It makes no sense.
    """
    sequence, given = node.items
    name, file = named(emitter, sequence), emitter.run(given)

    def go(t: SpelTask) -> None:
        path = as_text(file(t))
        if not path.lower().endswith(SUFFIX):
            raise SpelRefusal(RefusalKind.NOT_SIMULATED, f"A picture of another kind than {SUFFIX}")
        t.session.files.write(path, vision_of(t).image(name(t)))

    return go


def _setting(
    emitter: Emitter, node: VisionAccess, parts: list[Callable[[SpelTask], str]]
) -> Operation:
    if len(node.items) != 1 or node.index is not None:
        raise emitter.fault(tr("{word} takes one value", word="VSet"))
    value = emitter.run(node.items[0])

    def go(t: SpelTask) -> None:
        given = value(t)
        if not isinstance(given, (bool, int, float, str)):
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, "No property is a point")
        vision_of(t).set(tuple(part(t) for part in parts), given)

    return go


_SETTLING_NS: Final = 500_000_000
"""Time in ns between a motion and its picture: nMotionDelay of the calibrations that were seen."""

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
    """``VCal name``: the robot goes to each taught pose, with the selected tool."""
    name = named(emitter, node.items[0])

    def go(t: SpelTask) -> TaskWait:
        wanted = name(t)
        return WaitSequence(_calibrating(t, wanted, vision_of(t).taught_poses(wanted)))

    return go


def _calibrating(t: SpelTask, name: str, poses: tuple[Pose, ...]) -> Iterator[TaskWait]:
    pixels, places = list[Pixel](), list[tuple[float, float]]()
    vision, machine = vision_of(t), t.session.machine
    for pose in poses:
        going = StatementWait(t.runner.steps.carried_out(t, _go_to(pose)))
        yield going
        if going.execution.error is not None:
            raise RaisedError(going.execution.error.number, going.execution.error.text)
        t.now_ns = max(t.now_ns, going.execution.ended_ns)
        yield WaitUntil(lambda: False, lambda: None, end_ns=t.now_ns + _SETTLING_NS)
        t.now_ns += _SETTLING_NS
        machine.advance(t.now_ns)
        pixels.append(vision.target())
        x_mm, y_mm, *_ = machine.robot.here().coordinates
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
"""Compilers of the statements about the vision project and its calibrations, by keyword."""
