"""The work of a command in a thread of its own, and what may show it."""

import contextvars
import threading
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

import click

from robolink.interrupts import heard_by_this_thread
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.state import WizardState

T = TypeVar("T")


class Work(Generic[T]):
    """The work of one command in its thread.

    Attributes:
        result: What it returned.
        error: What ended it.
    """

    def __init__(self, do: Callable[[], T]) -> None:
        self._do = do
        self._ended = threading.Event()
        self._begun = threading.Event()
        self._click = click.get_current_context()
        self.result: T | None = None
        self.error: BaseException | None = None

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._ended.is_set()

    def start(self) -> None:
        """Begin; return when whatever ends the command reaches it."""
        here = contextvars.copy_context()
        threading.Thread(target=here.run, args=(self._run,), name="work", daemon=True).start()
        self._begun.wait()

    def wait(self, seconds: float) -> bool:
        """Wait for its end for so long; return whether it has come."""
        return self._ended.wait(seconds)

    def _run(self) -> None:
        try:
            with self._click.scope(cleanup=False), heard_by_this_thread():
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
