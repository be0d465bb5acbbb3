"""The promises of every kind of controller, compared with the machine itself after every call.

:mod:`robolink.testing` makes the same checks on single calls; here they apply to each call that the
people of a cell make, by whatever command: a value said to be read is the machine's, a value said
to be written is there, a selection takes effect, a movement that arrived is at its target, a pose
is that of the tip, a stop holds. The driver's own reads prove nothing here.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any
from unittest import mock

from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.group import EpsonGroup
from robolink.controllers.epson.movement import EpsonMotion
from robolink.controllers.motion_group import MotionGroupCore
from robolink.controllers.softmotion.controller import SoftMotionController
from robolink.controllers.softmotion.group import SoftMotionGroup
from robolink.controllers.softmotion.movement import SoftMotionMotion
from robolink.controllers.tool_table import ToolTableCore
from robolink.model import Marker, Motion, MotionOutcome, Pose
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.rules.contract import ContractRules

Call = Callable[..., Any]
Tell = Callable[[VirtualProcess, Any, "WatchedCall"], None]


@dataclass(frozen=True, slots=True)
class WatchedCall:
    """A call that has returned.

    Attributes:
        this: The object of the call.
        given: The positional arguments.
        named: The keyword arguments.
    """

    this: Any
    given: tuple[Any, ...]
    named: Mapping[str, Any]


@contextmanager
def watched(judge: ContractRules, process_of_this_thread: Callable[[], object]) -> Iterator[None]:
    """Pass each call of this library to a judge.

    Args:
        judge: Receives the result of each call.
        process_of_this_thread: Returns the process of a call; a call without one is not judged.
    """

    def judged(call: Call, tell: Tell) -> Call:
        def calling(this: object, *given: object, **named: object) -> object:
            process = process_of_this_thread()
            if not isinstance(process, VirtualProcess):
                return call(this, *given, **named)
            judge.begins(process)
            found = call(this, *given, **named)
            tell(process, found, WatchedCall(this, given, named))
            return found

        return calling

    def stopping(controller: ControllerCore) -> None:
        process, acknowledged = process_of_this_thread(), False
        if not isinstance(process, VirtualProcess):
            stop(controller)
            return
        judge.stopping(process)
        try:
            stop(controller)
            acknowledged = True
        finally:
            if process.alive:
                judge.has_stopped(process, controller, acknowledged=acknowledged)

    def releasing(controller: ControllerCore) -> None:
        process = process_of_this_thread()
        if isinstance(process, VirtualProcess):
            judge.releasing(process)
        release(controller)

    def marked(
        group: MotionGroupCore, target: Pose, request: str, *, selected: int | None
    ) -> Marker:
        process = process_of_this_thread()
        if isinstance(process, VirtualProcess):
            judge.aims(process, target.tool)
        return mark(group, target, request, selected=selected)

    def arrived(process: VirtualProcess, outcome: MotionOutcome, call: WatchedCall) -> None:
        if outcome is MotionOutcome.ARRIVED:
            judge.has_arrived(process, call.this)

    def begun(process: VirtualProcess, motion: Motion, call: WatchedCall) -> None:
        judge.has_begun(process, motion, call.given[0], call.named["box"])

    def pose_read(process: VirtualProcess, pose: Pose, _call: WatchedCall) -> None:
        judge.has_read_pose(process, pose)

    def reset(process: VirtualProcess, _none: None, call: WatchedCall) -> None:
        judge.has_reset(process, call.this)

    stop, release = ControllerCore.stop, ControllerCore.release_stop
    mark = MotionGroupCore._marked  # every kind of movement passes it
    calls: tuple[tuple[type, str, Tell], ...] = (
        (ToolTableCore, "read", lambda p, found, call: judge.has_read(p, call.given[0], found)),
        (ToolTableCore, "selected", lambda p, found, _: judge.has_read_selection(p, found)),
        (ToolTableCore, "write", lambda p, found, _: judge.has_written(p, found)),
        (ToolTableCore, "clear", lambda p, found, _: judge.has_written(p, found)),
        (ToolTableCore, "select", lambda p, _, call: judge.has_selected(p, call.given[0])),
        (EpsonMotion, "wait", arrived),
        (SoftMotionMotion, "wait", arrived),
        (EpsonGroup, "move_to", begun),
        (SoftMotionGroup, "move_to", begun),
        (EpsonGroup, "pose", pose_read),
        (SoftMotionGroup, "pose", pose_read),
        (EpsonController, "robot_number", lambda p, found, _: judge.has_read_robot(p, found)),
        (EpsonController, "reset_fault", reset),
        (SoftMotionController, "reset_fault", reset),
    )
    with ExitStack() as stack:
        for owner, name, tell in calls:
            call = judged(getattr(owner, name), tell)
            stack.enter_context(mock.patch.object(owner, name, call))
        stack.enter_context(mock.patch.object(MotionGroupCore, "_marked", marked))
        stack.enter_context(mock.patch.object(ControllerCore, "stop", stopping))
        stack.enter_context(mock.patch.object(ControllerCore, "release_stop", releasing))
        yield
