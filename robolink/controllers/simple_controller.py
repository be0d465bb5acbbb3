"""A controller in memory: the minimum of a kind, and something to write tests against.

It is no simulator: a movement has ended when it has begun, nothing fails, and there is no wire.
What it shares with a controller is what :mod:`robolink.controllers` promises of every kind.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final

from robolink import runtime
from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.driver_link import DriverLink, tell_requests
from robolink.controllers.motion_group import PolledGroup
from robolink.controllers.tool_table import ToolTableCore
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import ToolError, TransportClosedError
from robolink.interrupts import InterruptGate
from robolink.journal import memory_journal
from robolink.messages import tr
from robolink.model import (
    Capabilities,
    ControllerStatus,
    Expected,
    Hand,
    MotionProfile,
    OutcomeLog,
    Pose,
    ToolOffset,
    ToolReceipt,
    ToolTable,
    require_offset,
    rotate_xy,
)
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import Clock, SystemClock

_TOOLS: Final = range(1, 16)
_TOLERANCE: Final = 1e-6


@dataclass(slots=True)
class SimpleMachine:
    """A machine of four axes: what remains when nobody is connected.

    All that :class:`SimpleController` asks of it are ``read``, ``store``, ``in_force``, ``select``,
    ``pose``, ``go``, ``moving`` and ``halt``. A machine that overrides them is a kind of its own,
    with everything that robolink does for all kinds.

    Attributes:
        tools: The tools that are defined, by number.
        selected: The selected tool, 0 for the flange.
        flange: Where the flange is.
    """

    tools: dict[int, ToolOffset] = field(default_factory=dict)
    selected: int = 0
    flange: Pose = field(default_factory=lambda: Pose(300.0, 0.0, 100.0, 0.0, hand=Hand.RIGHT))

    def read(self, tool: int) -> ToolOffset | None:
        """Return what a tool holds, ``None`` where it is not defined."""
        return self.tools.get(tool)

    def store(self, tool: int, offset: ToolOffset | None) -> None:
        """Give a tool an offset, or clear it."""
        if offset is None:
            self.tools.pop(tool, None)
        else:
            self.tools[tool] = offset

    def in_force(self) -> int:
        """Return the number of the selected tool, 0 for the flange."""
        return self.selected

    def select(self, tool: int) -> None:
        """Select a tool."""
        self.selected = tool

    def pose(self) -> Pose:
        """Return where the tip of the selected tool is, mm and degrees in the base."""
        return self.tip(self.tool)

    def moving(self) -> bool:
        """Return whether the last movement goes on; here it ended when it began."""
        return False

    def halt(self) -> None:
        """Stop everything."""

    @property
    def tool(self) -> ToolOffset:
        """The offset of the selected tool."""
        return self.tools.get(self.selected, ToolOffset())

    def tip(self, offset: ToolOffset) -> Pose:
        """Return where a tip at an offset from the flange is."""
        dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, self.flange.u_deg)
        return replace(
            self.flange,
            x_mm=self.flange.x_mm + dx_mm,
            y_mm=self.flange.y_mm + dy_mm,
            z_mm=self.flange.z_mm + offset.z_mm,
            u_deg=self.flange.u_deg + offset.u_deg,
        )

    def go(self, target: Pose) -> None:
        """Move the tip of the selected tool to a pose."""
        offset, u_deg = self.tool, target.u_deg - self.tool.u_deg
        dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, u_deg)
        self.flange = replace(
            self.flange,
            x_mm=target.x_mm - dx_mm,
            y_mm=target.y_mm - dy_mm,
            z_mm=target.z_mm - offset.z_mm,
            u_deg=u_deg,
        )


class SimpleLink(DriverLink):
    """The connection to a machine in memory.

    Attributes:
        exchanges: Requests so far.

    Args:
        machine: The machine.
        identity: Its URL.
        outcomes: Where doubtful outcomes are kept.
        clock: On which its time passes.
    """

    def __init__(
        self, machine: SimpleMachine, identity: str, outcomes: OutcomeLog, clock: Clock
    ) -> None:
        gate = self._own_gate = InterruptGate()
        gate.open()
        super().__init__(identity, clock, StopLatch(identity), outcomes, gate=gate)
        tell_requests(self.latch, identity, clock)
        self._machine = machine
        self._wire = runtime.lock()
        self._closed = False
        self.exchanges = 0

    @contextmanager
    def exchange(
        self, request: str, kind: CommandClass = CommandClass.LOOK
    ) -> Iterator[SimpleMachine]:
        """Reach the machine for one request.

        Args:
            request: What it is, for a person.
            kind: What it does to the machine; a stop holds most of it back.

        Raises:
            StoppedError: A stop forbids it.
            TransportClosedError: The connection has ended.
        """
        with self.uninterrupted(), self._wire:
            if self._closed:
                raise TransportClosedError(
                    tr("The connection to {identity} is closed.", identity=self.identity),
                    remedy=tr("Connect again."),
                    controller=self.identity,
                )
            self.latch.admit(kind, request)
            self.exchanges += 1
            yield self._machine

    def close(self) -> None:
        """End the connection. Idempotent."""
        self._closed = True
        self._own_gate.close()


class SimpleController(ControllerCore):
    """A controller whose machine is an object of this process. Use it as a context manager.

    Args:
        machine: The machine; by default a new one.
        identity: Its URL, which is who it is as well.
        outcomes: Where its record is kept; by default in memory.
        clock: On which its time passes; by default that of this computer.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> machine = SimpleMachine(tools={1: ToolOffset(12, -3.5, -20)})
        >>> with SimpleController(machine) as controller:
        ...     controller.tools.read(1).x_mm
        12
    """

    def __init__(
        self,
        machine: SimpleMachine | None = None,
        *,
        identity: str = "memory+object://machine",
        outcomes: OutcomeLog | None = None,
        clock: Clock | None = None,
    ) -> None:
        outcomes = outcomes or memory_journal(identity).log(identity)
        link = SimpleLink(machine or SimpleMachine(), identity, outcomes, clock or SystemClock())
        self._link = link
        able = Capabilities(tool_write=True, motion=True)
        super().__init__(link, capabilities=able, tools=_MemoryTools(link))
        self.groups = (_MemoryGroup(link, self.tools),)

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._link.exchanges

    def _read_status(self) -> ControllerStatus:
        with self._link.exchange("status"):
            return ControllerStatus(remote=True, ready=True)

    def _close_link(self) -> None:
        self._link.close()


class _MemoryTools(ToolTableCore):
    def __init__(self, link: SimpleLink) -> None:
        super().__init__(link)
        self._link = link

    def indices(self) -> Sequence[int]:
        return _TOOLS

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        if a is None or b is None:
            return a is b
        require_offset("a", a)
        return a.matches(b, _TOLERANCE)

    def _storable(self, tool: int, offset: ToolOffset) -> ToolOffset:  # noqa: ARG002 - alike for all
        if offset.v_deg or offset.w_deg:
            raise ToolError(
                tr("This robot has four axes: a tool's V and W must be 0."),
                remedy=tr("Leave V and W out."),
            )
        return offset

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        request = self._request(tool, requested)
        write = _MemoryWrite(self._link, tool, requested, request, same=self.same)
        return write.change(expected)

    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        return f"tool {tool} = {requested}"

    def _stored(self, tool: int) -> ToolOffset | None:
        with self._link.exchange(f"tool {tool}") as machine:
            return machine.read(tool)

    def _selected(self) -> int:
        with self._link.exchange("selected") as machine:
            return machine.in_force()

    def _select_request(self, tool: int) -> str:
        return f"select {tool}"

    def _send_selection(self, tool: int) -> None:
        with self._link.exchange(self._select_request(tool), CommandClass.RESTORE) as machine:
            machine.select(tool)


class _MemoryWrite(ToolWrite):
    _link: SimpleLink

    def read_before(self, expected: Expected) -> ToolOffset | None:  # noqa: ARG002 - one way only
        return self.read_back()

    def send(self) -> None:
        with self._link.exchange(self.request, CommandClass.WRITE) as machine:
            machine.store(self.tool, self.requested)

    def read_back(self) -> ToolOffset | None:
        with self._link.exchange(f"tool {self.tool}") as machine:
            return machine.read(self.tool)


class _MemoryGroup(PolledGroup):
    def __init__(self, link: SimpleLink, tools: ToolTable) -> None:
        super().__init__(link, tools)
        self._link = link

    @property
    def name(self) -> str:
        return "robot in memory"

    def pose(self) -> Pose:
        with self._link.exchange("pose") as machine:
            return replace(machine.pose(), tool=machine.in_force())

    def requests_for(self, target: Pose, profile: MotionProfile) -> tuple[str, ...]:
        return (f"{profile.path} to {target}",)

    def moving(self) -> bool:
        with self._link.exchange("moving") as machine:
            return machine.moving()

    def _send_move(self, target: Pose, profile: MotionProfile) -> None:
        request, *_ = self.requests_for(target, profile)
        with self._link.exchange(request, CommandClass.ACT) as machine:
            machine.go(target)

    def _send_stop(self) -> None:
        with self._link.exchange("stop", CommandClass.CALM) as machine:
            machine.halt()
