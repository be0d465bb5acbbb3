"""Signs of life of an open block: that somebody is at work, although nothing is sent.

A change that is open while a person looks at the parts sends nothing, and who is silent for ten
seconds counts as gone: his lease may be taken (docs/reference/rules.md 6), and a PLC gives its
mailbox away (docs/mailbox.md, "Owners"). So as long as a block is open, both are told once a
second that its program is there. That keeps nothing going: no command, and no heartbeat of a
movement. It ends with the block, with the thread that is in it, and with the process.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from robolink import ambient
from robolink.errors import RobolinkError

EVERY_S: Final = 1.0
"""Between two signs: a tenth of the silence after which somebody counts as gone."""


class SignsOfLife:
    """Gives signs of life for as long as a block of this process is open on a controller.

    Args:
        sign: Gives one, to the record and to the controller. It may fail: what is the matter
            then, the next act of whoever is in the block says.
    """

    def __init__(self, sign: Callable[[], None]) -> None:
        self._sign = sign
        self._lock = threading.Lock()
        self._inside: list[threading.Thread] = []
        self._end: Callable[[], None] = _nothing

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Give them within the block; blocks inside of it give no more."""
        here = threading.current_thread()
        with self._lock:
            first = not self._inside
            self._inside.append(here)
            if first:
                self._end = ambient.regularly(EVERY_S, self._one, "signs of life")
        try:
            yield
        finally:
            end: Callable[[], None] = _nothing
            with self._lock:
                self._inside.remove(here)
                if not self._inside:
                    end, self._end = self._end, _nothing
            end()

    def _one(self) -> None:
        # A thread that has ended without leaving its block is at no work any more.
        if any(thread.is_alive() for thread in self._inside):
            with suppress(RobolinkError):
                self._sign()


def _nothing() -> None:
    """End nothing."""
