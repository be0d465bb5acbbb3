"""The work of a command in a thread of its own, and what may show it."""

import contextvars
import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any, Final, Generic, Protocol, TypeVar

import click

from robolink.errors import DeclinedError, RobolinkError
from robolink.interrupts import heard_by_this_thread, heed
from robolink.messages import tr
from robolink.runner import MoveSubject, Question
from robolink_cli.console.person import Person, person_here
from robolink_cli.wizard.happenings import (
    Happening,
    MovementHeld,
    Reading,
    SendAnswer,
    WaitsForAnswer,
    WasAsked,
    WasRead,
    WasRegarded,
    WasTold,
)
from robolink_cli.wizard.state import WizardState

FOLLOW_S: Final = 0.4
"""Interval in seconds between readings while the robot moves."""

GLANCE_S: Final = 0.3
"""Interval in seconds between readings of the controller while a question is open."""


class Desk:
    """The operator whom the work asks; a :class:`~robolink.runner.GuidedOperator`.

    Args:
        now_s: A monotonic clock of this computer, in seconds.
        after: Number of what was shown last: a press of then does not answer a question of now.
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic, after: int = 0) -> None:
        self._now_s = now_s
        self._happened: queue.SimpleQueue[Happening] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[SendAnswer] = queue.SimpleQueue()
        self._number = after
        self._told_waiting = False
        self._gone = False
        self._looked_s = 0.0
        self._moves = threading.Event()
        self.glance: Callable[[], Reading | None] = lambda: None
        self.silent_s: Callable[[], float] = lambda: 0.0

    def tell(self, text: str) -> None:
        """Show a line."""
        self._happened.put(WasTold(text))

    def regard(self, subject: object) -> None:
        """Note ``subject`` as the subject of what comes next."""
        if isinstance(subject, MoveSubject):
            self._moves.set()
        self._happened.put(WasRegarded(subject))

    def ask(self, question: str, kind: Question) -> None:
        """Ask; earlier answers no longer count."""
        self._moves.clear()
        self._number += 1
        self._told_waiting = False
        self._happened.put(WasAsked(self._number, question, kind, self._now_s()))

    def poll(self, wait_s: float) -> str | None:
        """Return the answer, ``None`` when none came; read the controller meanwhile.

        Raises:
            DeclinedError: There is nobody to answer any more.
            Interrupted: The work is to end.
        """
        end_s = self._now_s() + wait_s
        if not self._told_waiting:
            self._told_waiting = True
            self.look()
            self._happened.put(WaitsForAnswer(self._number, self._now_s()))
        while True:
            heed()
            self._require_somebody()
            left_s = end_s - self._now_s()
            try:
                answer = self._answers.get(timeout=max(0.0, min(GLANCE_S, left_s)))
            except queue.Empty:
                if self._now_s() - self._looked_s >= GLANCE_S:
                    self.look()
                if self._now_s() >= end_s:
                    return None
                continue
            if answer.number == self._number:
                self._told_waiting = False
                return answer.text

    def wait_while(self, why: Callable[[], str]) -> None:
        """Wait as long as something keeps the work back; say what, and read the controller.

        Args:
            why: Returns what keeps it back, empty for nothing.

        Raises:
            DeclinedError: There is nobody any more who could change that.
            Interrupted: The work is to end.
        """
        told = ""
        while reason := why():
            heed()
            self._require_somebody()
            if reason != told:
                self.regard(MovementHeld(reason))
                self.tell(reason)
                told = reason
            self.look()
            time.sleep(GLANCE_S)
        if told:
            self.regard(MovementHeld(""))
            self.tell(tr("The robot goes on."))

    def _require_somebody(self) -> None:
        if self._gone and person_here() is Person.WIRE:
            raise DeclinedError(
                tr("The panel is gone. Nothing was answered for you."),
                remedy=tr("Start the job again from its page."),
            )
        if self._gone:
            raise DeclinedError(
                tr("The keyboard is gone. Nothing was answered for you."),
                remedy=tr("Run it on a terminal, or with --assist on a simulator."),
            )

    @contextmanager
    def following(self, look: Callable[[], Reading | None]) -> Iterator[None]:
        """Read the controller while it moves, from a thread of its own, for the block.

        A look that fails ends this alone: whoever waits for the movement is told of it.
        """
        over = threading.Event()

        def follow() -> None:
            while not over.wait(FOLLOW_S):
                if not self._moves.is_set():
                    continue
                try:
                    reading = look()
                except (RobolinkError, OSError):
                    self._moves.clear()
                    continue
                if reading is not None and self._moves.is_set():
                    self._happened.put(WasRead(reading))

        thread = threading.Thread(target=follow, name="following", daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def happened(self) -> list[Happening]:
        """Return what happened since the last call; for the face."""
        found: list[Happening] = []
        while True:
            try:
                found.append(self._happened.get_nowait())
            except queue.Empty:
                return found

    def leave(self) -> None:
        """Report that there is nobody to answer any more; for the face."""
        self._gone = True

    def answer(self, answer: SendAnswer) -> None:
        """Answer; for the face."""
        self._answers.put(answer)

    def look(self) -> None:
        """Look at the controller now, and show what was read."""
        self._looked_s = self._now_s()
        reading = self.glance()
        if reading is not None:
            self._happened.put(WasRead(reading))


T = TypeVar("T")


class Work(Generic[T]):
    """The work of one command in its thread.

    Args:
        do: The work.
        context: The command's; by default that of the caller, if there is one by now.

    Attributes:
        result: What it returned.
        error: What ended it.
    """

    def __init__(self, do: Callable[[], T], context: click.Context | None = None) -> None:
        self._do = do
        self._ended = threading.Event()
        self._begun = threading.Event()
        self._click = context or click.get_current_context(silent=True)
        self.result: T | None = None
        self.error: BaseException | None = None

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    def start(self) -> None:
        """Start; return when whatever ends the command reaches it."""
        here = contextvars.copy_context()
        threading.Thread(target=here.run, args=(self._run,), name="work", daemon=True).start()
        self._begun.wait()

    def wait(self, seconds: float) -> bool:
        """Wait for its end for so long; return whether it has come."""
        return self._ended.wait(seconds)

    def _scope(self) -> AbstractContextManager[object]:
        return nullcontext() if self._click is None else self._click.scope(cleanup=False)

    def _run(self) -> None:
        try:
            with self._scope(), heard_by_this_thread():
                self._begun.set()
                self.result = self._do()
        except BaseException as error:
            self.error = error
        finally:
            self._begun.set()
            self._ended.set()


class Face(Protocol):
    """Shows a desk to a person."""

    def run(self, desk: Desk, state: WizardState, work: "Work[Any]") -> WizardState:
        """Show it until the work has ended; return the last state."""
