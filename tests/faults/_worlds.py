"""One run, and many worlds with a disturbance in it: each in a fork of this process.

The run, its simulator and its journal are in this process. At an instant it forks, and a
disturbance occurs in the child only: the program is killed, or somebody presses Ctrl-C or the
emergency stop. The child checks the conditions then, while the run in the parent waits for its end.
So one run serves all instants, and none starts a process.

If the program is killed nothing of it goes on, not even to clean up: its connection is gone, its
process has ended as far as the system shows, and the controller carries out what it has received.
"""

import gc
import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, Protocol, TypeVar

import pytest
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.hosting.in_process.transport import InProcessTransport

from robolink import interrupts
from robolink.controllers.driver_link import DriverLink
from robolink.journal import _lease_view
from tests.faults._recipe_instants import Instant, Instants, Kind

Ended = TypeVar("Ended")

_OF_A_PROGRAM: Final[dict[type, tuple[str, ...]]] = {
    InProcessTransport: ("send", "receive", "receive_waiting", "wait_readable", "close"),
    InProcessMailboxLink: ("_exchange", "close"),
}
"""The calls of a program on its connection. A dead program makes none of them."""


class _Connection(Protocol):
    def close(self) -> None: ...


class Worlds(Instants):
    """Sees the instants of a run, and disturbs some of them.

    Attributes:
        came_at: The instant of the disturbance.
        told: The faults found in those worlds, with their instants.

    Args:
        comes: How many worlds to disturb at an instant.
        happens: The disturbance; without it the program is killed, at an exchange or at a commit.
    """

    def __init__(
        self, comes: Callable[[Instant], int], happens: Callable[[Instant], None] | None = None
    ) -> None:
        super().__init__()
        self.came_at: list[Instant] = []
        self.told: list[str] = []
        self._comes = comes
        self._happens = happens
        self._check: Callable[[], None] = lambda: None
        self._asked = Counter[str]()
        self._connection: _Connection | None = None
        self._tells_to = -1
        self._dead = False

    @property
    def in_between(self) -> bool:
        """Whether this is a world with the disturbance."""
        return self._tells_to >= 0

    def pass_by(self, kind: Kind, what: str = "") -> None:
        """Pass one instant, or disturb it."""
        if not self.in_between:
            super().pass_by(kind, what)
            at = self.passed[-1]
            self._asked[f"{kind} {what}"] += 1
            if any(self._fork() for _ in range(self._comes(at))):
                self._dead = self._happens is None
                if self._happens is not None:
                    self._happens(at)
        if self._dead and kind in ("commit", "question"):
            self._leave()

    def explore(self, run: Callable[[], Ended], check: Callable[[], None]) -> Ended:
        """Run, with the program killed at its instants; return how it ended undisturbed.

        Args:
            run: The program.
            check: The conditions in a world in which it was killed.
        """
        self._check = check
        with self._deadly():
            return self._run(run, lambda _ended: pytest.fail("the dead program came to its end"))

    def explore_ends(self, run: Callable[[], Ended], check: Callable[[Ended], None]) -> Ended:
        """Run to the end in every world; return how it ended undisturbed.

        Args:
            run: The program.
            check: The conditions at the end of a disturbed world.
        """
        return self._run(run, check)

    def _run(self, run: Callable[[], Ended], check: Callable[[Ended], None]) -> Ended:
        try:
            with pytest.MonkeyPatch.context() as patch:
                # A thread that stores something while the process forks would leave its lock
                # behind.
                patch.setattr(DriverLink, "_sign_of_life", lambda _link: None)
                ended = run()
            if self.in_between:
                check(ended)
        except BaseException:
            if not self.in_between:
                raise
            self._tell()
        if self.in_between:
            os._exit(0)
        return ended

    @contextmanager
    def _deadly(self) -> Iterator[None]:
        with pytest.MonkeyPatch.context() as patch:
            for kind, names in _OF_A_PROGRAM.items():
                for name in names:
                    patch.setattr(kind, name, self._until_death(getattr(kind, name)))
            yield

    def _until_death(self, act: Callable[..., object]) -> Callable[..., object]:
        def acted(connection: Any, *arguments: Any, **named: Any) -> object:
            self._connection = connection
            try:
                return act(connection, *arguments, **named)
            finally:
                if self._dead:
                    self._leave()

        return acted

    def _fork(self) -> bool:
        """Return whether this is the child."""
        at = self.passed[-1]
        nth = self._asked[f"{at.kind} {at.what}"]
        self.came_at.append(at)
        reading, writing = os.pipe()
        if child := os.fork():
            os.close(writing)
            with os.fdopen(reading, encoding="utf-8") as told:
                said = told.read()
            _, status = os.waitpid(child, 0)
            if said or status:
                self.told.append(f"at {at.kind} {nth} of {at.what}: {said or status}")
            return False
        os.close(reading)
        gc.disable()  # it would look at, and so copy, all that this short world shares
        self._tells_to = writing
        return True

    def _leave(self) -> None:
        """Be the world without the program: check it, and end."""
        self._dead = False
        ended, program = _lease_view._has_ended, os.getppid()
        try:
            _lease_view._has_ended = lambda pid, start: pid == program or ended(pid, start)
            interrupts._handler = interrupts._Handler()
            if self._connection is not None:
                self._connection.close()
            self._check()
        except BaseException:
            self._tell()
        finally:
            os._exit(0)

    def _tell(self) -> None:
        os.write(self._tells_to, traceback.format_exc().encode()[-4000:])
