"""A stop from a second thread, at a chosen checkpoint of the main thread.

The main thread waits at that point until the second thread's stop is acknowledged, or waits for a
lock that the main thread holds; in that case it goes on to its next point outside the lock, and
waits there. So a run with a stop at a point is the same each time, although two real threads and
real locks take part.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import pytest

from robolink.checkpoints import Checkpoint, observed
from robolink.controllers import EpsonController, PlcMapController, SoftMotionController
from robolink.errors import RobolinkError
from robolink.model import Controller

_KINDS: Final = (EpsonController, SoftMotionController, PlcMapController)
_WAIT_S: Final = 60.0


@dataclass(frozen=True)
class Placement:
    """A point of a run: its kind, its subject, and the step of the procedure."""

    point: Checkpoint
    what: str
    step: int

    def __str__(self) -> str:
        return f"{self.point} {self.what!r} in step {self.step}"


class Placements:
    """Lists the distinct points of a run, and stops the controller at one of them.

    Attributes:
        distinct: The points at which a controller could be stopped, in order.
        refused: The reason if the stop was not acknowledged.
        acknowledged: Whether it was.

    Args:
        at: The point of the stop; ``None`` for none.
        on_acknowledged: Called, in the main thread's time, when it is.
    """

    def __init__(
        self, at: Placement | None = None, on_acknowledged: Callable[[], None] = lambda: None
    ) -> None:
        self.distinct: dict[Placement, None] = {}
        self.refused: RobolinkError | None = None
        self.acknowledged = False
        self._at = at
        self._on_acknowledged = on_acknowledged
        self._step = 0
        self._held = ""
        self._at_end = False
        self._controller: Controller | None = None
        self._stopper: threading.Thread | None = None
        self._at_lock = threading.Event()

    @contextmanager
    def watching(self) -> Iterator[None]:
        """See every checkpoint of the block, and the controller opened in it."""
        with pytest.MonkeyPatch.context() as patch:
            for kind in _KINDS:
                patch.setattr(kind, "__enter__", self._entering(kind.__enter__))
                patch.setattr(kind, "close", self._closing(kind.close))
            with observed(self._passed):
                yield

    def place_on(self, controller: Controller) -> None:
        """Stop this controller, which was opened before."""
        self._controller = controller

    def _entering(self, enter):
        def entered(controller):
            self._controller = controller
            return enter(controller)

        return entered

    def _closing(self, close):
        def closed(controller):
            close(controller)
            self._controller = None

        return closed

    def _passed(self, point: Checkpoint, what: str) -> None:
        if threading.current_thread() is not threading.main_thread():
            if point is Checkpoint.LOCK:
                self._at_lock.set()
            return
        if point in (Checkpoint.STEP, Checkpoint.PROCEDURE):
            self._step += 1
        if point is Checkpoint.EXCHANGE and what == self._held:
            self._held = ""
        here = Placement(point, what, self._step)
        if point is Checkpoint.HELD:
            self._held = what
        if self._stopper is not None:
            if not self._held:
                self._see_the_stop_through()
        elif self._placeable(here):
            self.distinct[here] = None
            if here == self._at:
                assert self._controller is not None
                self._stop(self._controller, held=bool(self._held))

    def _placeable(self, here: Placement) -> bool:
        # Once the logout is on its way there is no session left to stop anything with.
        over = here.point in (Checkpoint.HELD, Checkpoint.EXCHANGE) and here.what == "Logout"
        return self._controller is not None and here not in self.distinct and not over

    def _stop(self, controller: Controller, *, held: bool) -> None:
        def stop() -> None:
            try:
                controller.stop()
            except RobolinkError as error:
                self.refused = error
            else:
                self.acknowledged = True
            finally:
                self._at_lock.set()  # a point that needs no lock never waits at one

        self._stopper = threading.Thread(target=stop)
        self._stopper.start()
        if held:
            assert self._at_lock.wait(_WAIT_S), "the stop waits for something else"
        else:
            self._see_the_stop_through()

    def _see_the_stop_through(self) -> None:
        stopper = self._stopper
        if stopper is not None and not self._at_end:
            stopper.join(_WAIT_S)
            assert not stopper.is_alive(), "the stop does not end"
            self._at_end = True
            self._on_acknowledged()
