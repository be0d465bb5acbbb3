"""Runs the work of a command in a thread of its own, while a face shows it in the main one."""

import contextvars
import sys
import threading
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

import click

from robolink.interrupts import heard_by_this_thread
from robolink_cli.console.output import shown_by
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.present import sitting_at
from robolink_cli.wizard.state import Header, WizardState

T = TypeVar("T")


class Face(Protocol):
    """Shows a desk to a person."""

    def run(self, desk: Desk, state: WizardState, work: "Work[Any]") -> WizardState:
        """Show it until the work has ended; return the last state."""


class Work(Generic[T]):
    """The work of one command in its thread.

    Attributes:
        result: What it returned.
        error: What ended it.
    """

    def __init__(self, do: Callable[[], T]) -> None:
        self._do = do
        self._ended = threading.Event()
        self._click = click.get_current_context()
        self.result: T | None = None
        self.error: BaseException | None = None

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    def start(self) -> None:
        """Begin."""
        here = contextvars.copy_context()
        threading.Thread(target=here.run, args=(self._run,), name="work", daemon=True).start()

    def wait(self, seconds: float) -> bool:
        """Wait for its end for so long; return whether it has come."""
        return self._ended.wait(seconds)

    def _run(self) -> None:
        try:
            with self._click.scope(cleanup=False), heard_by_this_thread():
                self.result = self._do()
        except BaseException as error:
            self.error = error
        finally:
            self._ended.set()


def guided(header: Header, do: Callable[[], T]) -> T:
    """Do the work of a command, guided by a face on this process's terminal.

    Args:
        header: What stands in the first row.
        do: The work; what it asks and shows goes to the face.

    Raises:
        BaseException: Whatever ended the work.
    """
    from robolink_cli.wizard.faces.choice import face_here

    desk, work, state = Desk(), Work(do), WizardState(header)
    face = face_here()
    with sitting_at(desk), shown_by(lambda text, _beside: desk.tell(text)):
        work.start()
        face.run(desk, state, work)
    if work.error is not None:
        raise work.error
    return work.result  # type: ignore[return-value]


def may_be_guided() -> bool:
    """Tell whether a person sits at both ends of this process's terminal."""
    return sys.stdin.isatty() and sys.stderr.isatty()
