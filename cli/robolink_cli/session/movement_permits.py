"""What a cell and a page ask for before each movement: a key switch, and somebody who is there."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Final

from robolink.errors import NotReadyError, NotReadyReason, RobolinkError
from robolink.messages import tr
from robolink_cli.console.person import Person, person_here
from robolink_cli.prompts.current_desk import current_desk

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from robolink.config import Cell
    from robolink.model import Controller
    from robolink_cli.prompts.current_desk import AskingDesk

ALIVE_S: Final = 1.5
"""Time in seconds for which a sign of life of the page counts."""

_LOOK_S: Final = 0.1


def asking_for_permits(
    controller: "Controller", url: str, cell: "Cell | None"
) -> "AbstractContextManager[None]":
    """Let each movement wait for what the cell and the page ask for, for the block.

    Args:
        controller: The controller, connected.
        url: How it was reached.
        cell: What the cell files say; ``None`` where no cell was named.
    """
    enable = None if cell is None else cell.settings.enable_input
    desk = current_desk()
    if enable is None and (desk is None or person_here() is not Person.WIRE):
        return nullcontext()
    from robolink.runner import permitted_by  # numpy is near, and a look needs none

    stop_s = None if cell is None else cell.settings.stop_on_silence_s
    return permitted_by(controller, CellPermit(controller, url, enable, desk, stop_s))


class CellPermit:
    """Lets movements of one controller begin; a :class:`robolink.runner.MovementPermit`.

    At a desk it waits until one may begin, and says for what. Without one, and for a step by hand,
    it refuses: nobody would know of the wait, and the finger is gone after it.

    Args:
        controller: The controller.
        url: How it was reached.
        enable: Number of the input that has to be on; ``None`` for none.
        desk: Where a person is asked; ``None`` where nobody is.
        stop_s: For how long the page may be silent during a movement; ``None`` for any time.
    """

    def __init__(
        self,
        controller: "Controller",
        url: str,
        enable: int | None,
        desk: "AskingDesk | None",
        stop_s: float | None,
    ) -> None:
        self._controller = controller
        self._url = url
        self._enable = enable
        self._desk = desk
        self._stop_s = stop_s

    @contextmanager
    def __call__(self, *, by_hand: bool) -> Iterator[None]:
        """Wait, and watch the movement that is made in the block.

        Raises:
            NotReadyError: It may not begin, and is not waited for.
            ConfigError: The controller has no inputs.
            DeclinedError: Nobody is there any more.
        """
        desk = self._desk
        if desk is not None and not by_hand:
            desk.wait_while(self._why_not)
        elif why := self._why_not():
            raise NotReadyError(
                why,
                reason=NotReadyReason.NOT_PERMITTED,
                remedy=tr("Nothing moved."),
                controller=self._controller.identity,
            )
        if desk is None or self._stop_s is None:
            yield
            return
        over = threading.Event()
        args = (desk, self._stop_s, over)
        thread = threading.Thread(target=self._watch, args=args, name="silence", daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def _why_not(self) -> str:
        """Return why no movement may begin now; empty for nothing."""
        if self._desk is not None and self._desk.silent_s() > ALIVE_S:
            return tr("The tablet is not heard. The robot waits for it.")
        if self._enable is None:
            return ""
        from robolink.runner import inputs_of

        if inputs_of(self._controller).read_input(self._enable):
            return ""
        return tr("Input {n}, which allows movement, is off. Switch it on.", n=self._enable)

    def _watch(self, desk: "AskingDesk", stop_s: float, over: threading.Event) -> None:
        """Stop the robot if the page is silent for too long."""
        while not over.wait(_LOOK_S):
            if desk.silent_s() <= stop_s:
                continue
            confirmed = False
            try:
                self._controller.stop()
                confirmed = True
            except RobolinkError as error:
                desk.tell(error.what)
            self._leave_note(desk, confirmed=confirmed)
            return

    def _leave_note(self, desk: "AskingDesk", *, confirmed: bool) -> None:
        """Let the next command ask about this stop, like one from another terminal."""
        from robolink.stopping import leave_note
        from robolink.transport import far_end_of
        from robolink_cli.stopping.notes import own_name_of

        who = tr("a page that was not heard any more")
        name, told = own_name_of(self._controller), self._url.partition("?")[0]
        try:
            leave_note(far_end_of(self._url), told, who, confirmed=confirmed, controller=name)
        except OSError as error:
            desk.tell(str(error))
