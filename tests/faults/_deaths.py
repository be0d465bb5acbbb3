"""A program that dies at each of many instants of one run: each time in a fork of this process.

The run, its simulator and its journal are in this process. At an instant it forks, and the child
is the world in which the program was killed there: nothing of the program goes on, not even to
clean up; its connection is gone, its process has ended for whoever asks the system, and the
controller carries out what it was given. What must be true then is checked in the child, while
the run in the parent waits for its end. So one run serves all instants, and none starts a process.
"""

import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from robolink_simulators.hosting.in_process.transport import InProcessTransport

from robolink import interrupts
from robolink.journal import _lease_view
from tests.faults._recipe_instants import Instants, Kind

_OF_A_PROGRAM = ("send", "receive", "receive_waiting", "wait_readable", "close")
"""What a program does to its connection. It gets no further once it is dead."""


class Deaths(Instants):
    """Sees the exchanges of a run, and lets the program die at some of them.

    Attributes:
        chances: At how many instants it could die.
        told: What was wrong in the worlds in which it died, and where that was.

    Args:
        dies: Whether it dies at the instant of that number, counted from 0.
        check: What must be true then.
    """

    def __init__(self, dies: Callable[[int], bool], check: Callable[[], None]) -> None:
        super().__init__()
        self.chances = 0
        self.told: list[str] = []
        self._dies = dies
        self._check = check
        self._asked = ""
        self._counts_of = Counter[str]()
        self._dead = False
        self._told_to = -1

    def pass_by(self, kind: Kind, what: str = "") -> None:
        """Let one go by, or die: before a request is carried out, or before its answer leaves."""
        if self._dead or kind not in ("request", "answer"):
            return
        if kind == "request":
            self._asked = what
            self._counts_of[what] += 1
        self.chances += 1
        if self._dies(self.chances - 1):
            self._fork(f"killed at {kind} {self._counts_of[self._asked]} of {self._asked}")

    @contextmanager
    def deadly(self) -> Iterator[None]:
        """Let whoever is dead do nothing more to a connection."""
        with pytest.MonkeyPatch.context() as patch:
            for name in _OF_A_PROGRAM:
                patch.setattr(InProcessTransport, name, self._until_death(name))
            yield

    def _until_death(self, name: str) -> Callable[..., object]:
        act: Callable[..., object] = getattr(InProcessTransport, name)

        def acted(transport: InProcessTransport, *arguments: Any, **named: Any) -> object:
            result = act(transport, *arguments, **named)
            if self._dead:
                self._leave(transport)
            return result

        return acted

    def _fork(self, where: str) -> None:
        reading, writing = os.pipe()
        if child := os.fork():
            os.close(writing)
            with os.fdopen(reading, encoding="utf-8") as told:
                said = told.read()
            _, status = os.waitpid(child, 0)
            if said or status:
                self.told.append(f"{where}: {said or status}")
            return
        os.close(reading)
        self._dead, self._told_to = True, writing

    def _leave(self, transport: InProcessTransport) -> None:
        """Be the world without the program: look at it, and end."""
        self._dead = False
        ended, program = _lease_view._has_ended, os.getppid()
        try:
            _lease_view._has_ended = lambda pid, start: pid == program or ended(pid, start)
            interrupts._handler = interrupts._Handler()
            transport.close()
            self._check()
        except BaseException:
            os.write(self._told_to, traceback.format_exc().encode()[-4000:])
        finally:
            os._exit(0)
