"""Questions to the plant's database, one after the other, in a thread that may hang.

The database may be slow, locked or away. Whoever asks waits a limited time, and is told that; the
page of a cell, and STOP, are asked by nobody here. The thread is one that the end of the panel does
not wait for.
"""

import asyncio
import contextvars
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, TypeVar

from robolink.fleet import LineJobStore, PlantError, default_plant
from robolink.messages import tr

ANSWER_S: Final = 3.0
"""Longest wait for the plant's database, in s."""

MOST_WAITING: Final = 32
"""Questions that may wait; a further one is refused at once."""

T = TypeVar("T")

Question = Callable[[LineJobStore, Callable[[], None]], T]
"""Asks the store. The second argument raises :class:`~robolink.fleet.PlantError` once nobody waits
for the answer any more: called as the last thing in a transaction, it undoes that."""


class PlantDesk:
    """Asks the plant's database in a thread of its own.

    Args:
        location: Returns where the database is.
    """

    def __init__(self, location: Callable[[], str] = default_plant) -> None:
        self._location = location
        self._questions: queue.Queue[Callable[[], None] | None] = queue.Queue(MOST_WAITING)
        self._store: tuple[str, LineJobStore] | None = None
        self._thread = threading.Thread(target=self._serve, name="robolink-plant", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread, after what it is at; does not wait for it."""
        with suppress(queue.Full):
            self._questions.put_nowait(None)

    async def ask(self, question: Question[T], within_s: float = ANSWER_S) -> T:
        """Ask the store.

        Args:
            question: What is asked.
            within_s: Longest wait for the answer, in s.

        Raises:
            PlantError: The database does not answer in time, or cannot be used.
        """
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[T] = loop.create_future()
        gone = threading.Event()
        here = contextvars.copy_context()  # errors speak the language of whoever asks

        def confirm() -> None:
            if gone.is_set():
                raise _unanswered()

        def carry_out() -> None:
            if gone.is_set():
                return
            try:
                found = here.run(lambda: question(self._opened(), confirm))
            except Exception as error:  # told to whoever asked
                _settle(loop, answer, error=error)
            else:
                _settle(loop, answer, found)

        try:
            self._questions.put_nowait(carry_out)
        except queue.Full:
            raise _unanswered() from None
        try:
            return await asyncio.wait_for(answer, within_s)
        except TimeoutError:
            raise _unanswered() from None
        finally:
            gone.set()

    def _opened(self) -> LineJobStore:
        """Return the store; a cell file may name another one since."""
        location = self._location()
        if self._store is None or self._store[0] != location:
            if self._store is not None:
                self._store[1].close()
            self._store = (location, LineJobStore(location))
        return self._store[1]

    def _serve(self) -> None:
        while (question := self._questions.get()) is not None:
            question()
        if self._store is not None:
            self._store[1].close()


def _unanswered() -> PlantError:
    return PlantError(
        tr("No answer came from the plant's database."),
        remedy=tr("Check the server. Cells, jobs and STOP do not need it."),
    )


def _settle(
    loop: asyncio.AbstractEventLoop,
    answer: "asyncio.Future[Any]",
    found: object = None,
    *,
    error: BaseException | None = None,
) -> None:
    def settle() -> None:
        if answer.done():
            return
        if error is None:
            answer.set_result(found)
        else:
            answer.set_exception(error)

    with suppress(RuntimeError):  # the loop is over
        loop.call_soon_threadsafe(settle)
