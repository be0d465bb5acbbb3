"""A program of this process that is killed at one instant of its run.

Nothing of a killed program goes on, not even to clean up: its connection is gone, the system shows
that its process has ended, and the controller carries out what it has received. So the conditions
are checked where it died, on its stack. Only then is it unwound, and nothing that it does
meanwhile arrives anywhere.

A run is the same each time up to this instant. So a cell and a run of its own for each instant say
the same as a process of its own. A fork would cost more, the more memory the tests have.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, Literal, Protocol

import pytest
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.hosting.in_process.transport import InProcessTransport

from robolink import interrupts
from robolink.controllers.driver_link import DriverLink
from tests.faults._recipe_instants import Instant, Instants, Kind, noted

_OF_A_PROGRAM: Final[dict[type, tuple[str, ...]]] = {
    InProcessTransport: ("send", "receive", "receive_waiting", "wait_readable", "close"),
    InProcessMailboxLink: ("_exchange", "close"),
}
"""The calls of a program on its connection. A dead program makes none of them."""


class _Connection(Protocol):
    def close(self) -> None: ...


class _Unwound(BaseException):
    """Ends what is left of a dead program."""


class _Life(Instants):
    """A program's instants until it is killed.

    Attributes:
        state: Whether it runs, is about to die, has died and is looked at, or is only unwound.
        found: What is wrong after its death.
    """

    def __init__(self, at: Instant, check: Callable[[], object]) -> None:
        super().__init__(at, self._doom)
        self.state: Literal["runs", "dies", "dead", "unwound"] = "runs"
        self.found: BaseException | None = None
        self._check = check
        self._connection: _Connection | None = None
        self._number = pytest.MonkeyPatch()

    def pass_by(self, kind: Kind, what: str = "") -> None:
        """Pass one instant, which may be the last."""
        if self.state == "unwound":
            raise _Unwound
        if self.state == "runs":
            super().pass_by(kind, what)
        if self.state == "dies" and kind in ("commit", "question"):
            self._die()

    @contextmanager
    def lived(self) -> Iterator[None]:
        """Be the program of a process that has ended, as the system shows from the beginning."""
        ended = os.posix_spawnp("true", ["true"], os.environ)
        os.waitid(os.P_PID, ended, os.WEXITED | os.WNOWAIT)
        try:
            with pytest.MonkeyPatch.context() as patch:
                self._number.setattr(os, "getpid", lambda: ended)
                patch.setattr(DriverLink, "_sign_of_life", lambda _link: None)  # in a thread
                for kind, names in _OF_A_PROGRAM.items():
                    for name in names:
                        patch.setattr(kind, name, self._until_death(getattr(kind, name)))
                yield
        finally:
            self._number.undo()
            os.waitpid(ended, 0)

    def _until_death(self, act: Callable[..., object]) -> Callable[..., object]:
        def acted(connection: Any, *arguments: Any, **named: Any) -> object:
            if self.state == "unwound":
                raise _Unwound
            if self.state == "runs":
                self._connection = connection
            try:
                return act(connection, *arguments, **named)
            finally:
                if self.state == "dies":
                    self._die()

        return acted

    def _doom(self) -> None:
        self.state = "dies"

    def _die(self) -> None:
        """Check the world without the program, and end what is left of it."""
        self.state = "dead"
        self._number.undo()
        handler = interrupts._handler
        try:
            interrupts._handler = interrupts._Handler()
            if self._connection is not None:
                self._connection.close()
            self._check()
        except BaseException as found:
            self.found = found
        finally:
            interrupts._handler = handler
            self.state = "unwound"
        raise _Unwound


def kill(run: Callable[[Instants], object], at: Instant, check: Callable[[], object]) -> None:
    """Run a program, kill it, and check the conditions.

    Args:
        run: The program, seen by instants.
        at: Its last instant: an exchange, or a commit.
        check: The conditions.
    """
    life = _Life(at, check)
    with life.lived():
        try:
            run(life)
        except BaseException:
            if life.state != "unwound":
                raise
    assert life.state == "unwound", f"it came to its end, without {at}"
    with noted(at):
        if life.found is not None:
            raise life.found
    assert life.passed[-1] == at
