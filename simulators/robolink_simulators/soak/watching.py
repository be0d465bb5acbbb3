"""The promises of every kind of controller, held to the machine itself after every call.

What :mod:`robolink.testing` asserts about a call is asserted here about each call that the people
of a cell make, by whatever command: what it says was read is what the machine held, what it says
was written is there, a selection is in force, a movement that arrived is over, a stop holds. The
driver's own reads prove nothing here.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, Protocol
from unittest import mock

from robolink.controllers.epson.motion.movement import EpsonMotion
from robolink.controllers.motion_group import MotionGroupCore
from robolink.controllers.softmotion.motion.movement import SoftMotionMotion
from robolink.controllers.tool_table import ToolTableCore
from robolink.model import Marker, MotionOutcome, Pose, ToolOffset, ToolReceipt
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.plant.machine import MachineState

Call = Callable[..., Any]
Tell = Callable[[VirtualProcess, Any, tuple[Any, ...]], None]


class Promises(Protocol):
    """Who judges what a call of a process has returned."""

    def begins(self, process: VirtualProcess) -> None:
        """A call begins: whatever the machine holds from now on may be what it tells."""

    def aims(self, process: VirtualProcess, tool: int | None) -> None:
        """A movement is about to leave that is meant for the tip of a tool."""

    def has_read(self, process: VirtualProcess, tool: int, offset: ToolOffset | None) -> None:
        """A tool was read."""

    def has_read_selection(self, process: VirtualProcess, tool: int | None) -> None:
        """The tool in force was read."""

    def has_written(self, process: VirtualProcess, receipt: ToolReceipt) -> None:
        """A tool was written or cleared."""

    def has_selected(self, process: VirtualProcess, tool: int) -> None:
        """A tool was put in force."""

    def has_arrived(self, process: VirtualProcess) -> None:
        """A movement ended by itself."""


@contextmanager
def watched(judge: Promises, process_of_this_thread: Callable[[], object]) -> Iterator[None]:
    """Let each call of this library pass a judge.

    Args:
        judge: Told of what a call returned.
        process_of_this_thread: Returns whose call it is; what is no process is not judged.
    """

    def judged(call: Call, tell: Tell) -> Call:
        def calling(this: object, *given: object, **named: object) -> object:
            process = process_of_this_thread()
            if not isinstance(process, VirtualProcess):
                return call(this, *given, **named)
            judge.begins(process)
            found = call(this, *given, **named)
            tell(process, found, given)
            return found

        return calling

    def marked(
        group: MotionGroupCore, target: Pose, request: str, *, selected: int | None
    ) -> Marker:
        process = process_of_this_thread()
        if isinstance(process, VirtualProcess):
            judge.aims(process, target.tool)
        return mark(group, target, request, selected=selected)

    def arrived(process: VirtualProcess, outcome: MotionOutcome, _given: tuple[Any, ...]) -> None:
        if outcome is MotionOutcome.ARRIVED:
            judge.has_arrived(process)

    mark = MotionGroupCore._marked  # noqa: SLF001 - every movement passes it, of whatever kind
    calls: tuple[tuple[type, str, Tell], ...] = (
        (ToolTableCore, "read", lambda p, found, given: judge.has_read(p, given[0], found)),
        (ToolTableCore, "selected", lambda p, found, _: judge.has_read_selection(p, found)),
        (ToolTableCore, "write", lambda p, found, _: judge.has_written(p, found)),
        (ToolTableCore, "clear", lambda p, found, _: judge.has_written(p, found)),
        (ToolTableCore, "select", lambda p, _, given: judge.has_selected(p, given[0])),
        (EpsonMotion, "wait", arrived),
        (SoftMotionMotion, "wait", arrived),
    )
    with ExitStack() as stack:
        for owner, name, tell in calls:
            call = judged(getattr(owner, name), tell)
            stack.enter_context(mock.patch.object(owner, name, call))
        stack.enter_context(mock.patch.object(MotionGroupCore, "_marked", marked))
        yield


class SeenStates:
    """What the machine has held since each call began, event by event."""

    def __init__(self) -> None:
        self._seen: list[MachineState] = []
        self._since: dict[int, int] = {}

    def note(self, state: MachineState) -> None:
        """Note what it holds, where that is something else than before."""
        if not self._seen or self._seen[-1] != state:
            self._seen.append(state)

    def begin(self, process: VirtualProcess) -> None:
        """Let a call of a process begin now."""
        self._since[process.number] = max(0, len(self._seen) - 1)

    def since(self, process: VirtualProcess) -> list[MachineState]:
        """Return what it has held since the last call of a process began."""
        return self._seen[self._since.get(process.number, 0) :]

    def forget(self) -> None:
        """Begin anew."""
        self._seen.clear()
        self._since.clear()
