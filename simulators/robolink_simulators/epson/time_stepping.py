"""How time passes in a simulated controller: what it does by itself, and when."""

from abc import ABC

from robolink.protocols.epson_text import ErrorCode
from robolink_simulators.epson.companion import Companion
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.mishaps import EpsonMishaps
from robolink_simulators.epson.remote.open_links import OpenLinks
from robolink_simulators.epson.remote.requests import RequestTaking
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner


class TimeStepping(RequestTaking, ABC):
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

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._begun = False
        # Until when all is done: a transport asks for one and the same instant several times.
        self._settled_ns = -1
        # What next_change found last, and for which of those instants.
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
        # While something goes on what comes next changes by itself.
        self._known_ns = -1 if self._at_work else self._settled_ns
        return self._next_ns

    @property
    def _knows_next(self) -> bool:
        """Whether nothing has happened since it was found that nothing goes on."""
        return self._settled_ns == self._known_ns != -1

    def _found_next(self) -> int | None:
        first = self._links.next_change()
        for change in (
            self._slot.deadline(unfinished=self._service.unfinished),
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
            self._next_ns = self._found_next()
        change = self._next_ns
        if change is not None and change <= now_ns:
            return False
        if now_ns > self.now_ns:
            self.machine.advance(now_ns)
        self.now_ns = self._settled_ns = self._known_ns = now_ns
        return True

    @property
    def _at_work(self) -> bool:
        """Whether something goes on that is looked at as time passes."""
        return (
            self.program is not None
            or self._window.busy
            or self.condition.task is Task.RUNNING
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
            if self._companion is not None and self.condition.task is Task.RUNNING:
                self._companion.publish_changes()
            self._supervise(now_ns)
            self._flash.save_changes()
            self._settled_ns, self._known_ns = now_ns, -1
        finally:
            self._stepping = False

    def _supervise(self, now_ns: int) -> None:
        """Keep the time-outs of docs/reference/epson.md 1.1."""
        overdue, client = self._slot.overdue(now_ns, unfinished=self._service.unfinished)
        watches_only = self.condition.monitoring_only
        if overdue and (not watches_only or self.options.monitoring_timeout == "error"):
            self._window.interrupt(now_ns)
            self.condition.raise_error(ErrorCode.TIMED_OUT)
        if client is not None:
            client.cut()
        self._links.supervise(now_ns)
