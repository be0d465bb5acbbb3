"""How time passes in a simulated controller: its own actions, and when.

The effect of the companion robolink_tools.prg in the simulated project.

The program is ours, so what it does is known; that the production program calls it at its
start and after each change of a tool is what the companion's documentation asks for.
"""

from abc import ABC
from collections.abc import Sequence
from typing import Final

from robolink.protocols.epson_text import ErrorCode, VariableType
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.tools import HIGHEST_TOOL
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.panel import EpsonMishaps
from robolink_simulators.epson.remote.link import OpenLinks
from robolink_simulators.epson.remote.requests import RequestService
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner

LAYOUT: Final = 1
LAST_COUNT: Final = 1_000_000_000
"""Highest count of publications; the next one is 1 again."""

_TOOLS: Final = range(1, HIGHEST_TOOL + 1)
_UNDEFINED: Final = (0.0,) * 6
_RUNNING: Final = Task.RUNNING  # before Python 3.12 a member of an Enum is found slowly


class Companion:
    """Copies a machine's tools into the project's Global Preserve variables.

    Args:
        machine: Whose tools.
        variables: Where the companion's variables are declared.
    """

    def __init__(self, machine: Machine, variables: Variables) -> None:
        self._machine = machine
        self._variables = variables
        self._published: tuple[Sequence[int], Sequence[float]] | None = None
        self._seen: tuple[int, int] | None = None
        self._count = 0
        variables.declare("robolink_begin", VariableType.LONG)
        variables.declare("robolink_end", VariableType.LONG)
        variables.declare("robolink_state", VariableType.LONG, 3 + HIGHEST_TOOL)
        variables.declare("robolink_tool", VariableType.DOUBLE, 6 * HIGHEST_TOOL - 1)

    def publish_changes(self) -> None:
        """Publish if a tool or the selection has changed since the last check."""
        tools = self._machine.tools
        mark = (tools.flash_writes, tools.selected)
        if mark != self._seen:
            self._seen = mark
            self.publish()

    def publish(self) -> None:
        """Carry out RobolinkPublish: nothing is stored when nothing has changed."""
        tools = self._machine.tools
        offsets = [tools.get(tool) for tool in _TOOLS]
        defined = [int(offset is not None) for offset in offsets]
        state = (LAYOUT, self._machine.robot_number, tools.selected, 0, *defined)
        rows = [offset.components() if offset else _UNDEFINED for offset in offsets]
        # On a four-axis robot the program leaves out V and W.
        table = [value for row in rows for value in (*row[:4], 0.0, 0.0)]
        if (state, table) == self._published:
            return
        self._published = (state, table)
        self._count = self._count % LAST_COUNT + 1
        self._variables.put_back(
            {
                "robolink_begin": (self._count,),
                "robolink_state": state,
                "robolink_tool": table,
                "robolink_end": (self._count,),
            }
        )


class SteppedController(RequestService, ABC):
    """Steps from one change to the next; between them nothing is done.

    Attributes:
        machine: The robot and its memory.
        program: The program that is loaded, if any.
    """

    machine: Machine
    program: ProgramRunner | None
    _mishaps: EpsonMishaps
    _links: OpenLinks
    _companion: Companion | None

    def __init__(self, seed: int, *, answer_ms: float = 0.0) -> None:
        super().__init__(seed, answer_ms=answer_ms)
        self._begun = False
        # Time until which everything is done: a transport asks for the same instant repeatedly.
        self._settled_ns = -1
        # The last result of next_change, and the instant that it was for.
        self._next_ns: int | None = None
        self._known_ns = -1

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""
        if now_ns == self._settled_ns or self._passes(now_ns):
            return
        while now_ns > self.now_ns < (change := self.next_change() or now_ns) < now_ns:
            self._step(change)
        self._step(max(now_ns, self.now_ns))

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        if not self._begun:
            return None
        return self._next_ns if self._knows_next else self._look_ahead()

    def _look_ahead(self) -> int | None:
        self._next_ns = self._found_next()
        # While something is in progress, the next event changes by itself.
        self._known_ns = -1 if self._at_work else self._settled_ns
        return self._next_ns

    @property
    def _knows_next(self) -> bool:
        """Whether nothing has happened since it was found idle."""
        return self._settled_ns == self._known_ns != -1

    def _found_next(self) -> int | None:
        first = self._links.next_change()
        for change in (
            self._slot.deadline(unfinished=self._unfinished),
            self._window.next_change(),
            self._mishaps.next_change(),
            self.machine.timed_bits.next_change(),
            None if self.program is None else self.program.next_change(),
        ):
            if change is not None and (first is None or change < first):
                first = change
        return first

    def _after_act(self) -> None:
        self._settled_ns = -1

    def _passes(self, now_ns: int) -> bool:
        """Let time pass in which nothing happens, as it mostly does; False when something may.

        What an idle controller does by itself :meth:`next_change` tells, all of it.
        """
        if not self._begun:
            self.now_ns = max(now_ns, self.now_ns)
            return True
        if now_ns < self.now_ns or not self._links.settled:
            return False
        if not self._knows_next:
            if self._at_work:
                return False
            if now_ns == self.now_ns and not self._plans:
                # Only a request came: of time-outs none is due that was not due before it.
                self._settled_ns, self._known_ns = now_ns, -1
                return True
            self._next_ns = self._found_next()
        change = self._next_ns
        if change is not None and change <= now_ns:
            return False
        if now_ns > self.now_ns:
            self.machine.advance(now_ns)
        self.now_ns = self._settled_ns = self._known_ns = now_ns
        return True

    @property
    def _plans(self) -> bool:
        """Whether something is to happen by itself, perhaps at once, that is no time-out."""
        return (
            self._mishaps.next_change() is not None
            or self.machine.timed_bits.next_change() is not None
        )

    @property
    def _at_work(self) -> bool:
        """Whether something is in progress that needs checking as time passes."""
        return (
            self.program is not None
            or self._window.busy
            or self.condition.task is _RUNNING
            or self.durable
            or self.machine.moving
        )

    def _step(self, now_ns: int) -> None:
        self.now_ns = now_ns
        self._stepping = True
        try:
            if self.program is not None:
                self.program.advance(now_ns)
            self.machine.advance(now_ns)
            self.machine.timed_bits.advance(now_ns)
            self._window.advance(now_ns)
            self._mishaps.carry_out(now_ns)
            if self._companion is not None and self.condition.task is _RUNNING:
                self._companion.publish_changes()
            self._supervise(now_ns)
            self._flash.save_changes()
            self._settled_ns, self._known_ns = now_ns, -1
        finally:
            self._stepping = False

    def _supervise(self, now_ns: int) -> None:
        """Apply the time-outs of docs/reference/epson.md 1.1."""
        overdue, client = self._slot.overdue(now_ns, unfinished=self._unfinished)
        watches_only = self.condition.monitoring_only
        if overdue and (not watches_only or self.options.monitoring_timeout == "error"):
            self._window.interrupt(now_ns)
            self.condition.raise_error(ErrorCode.TIMED_OUT)
        if client is not None:
            client.cut()
        self._links.supervise(now_ns)
