"""Copies to the plant what was recorded here: at the end of a command, and beside the panel.

Whatever keeps it from that is shown, and changes no exit code: the command's own work is done, and
the entries stay in the journal until somebody copies them.
"""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.config import named_plant
from robolink.errors import ConnectError, RobolinkError
from robolink.files.durable import make_folder, state_folder, write_whole
from robolink.journal import Journal, journals_in_use
from robolink.messages import tr
from robolink_cli.console.render import note

CONNECT_S: Final = 1.0
"""Longest wait for the plant's database at the end of a command, in s."""

PLANT_S: Final = 10.0
"""Pause in s between two looks whether the plant lacks entries, where nobody waits for them."""

COPY_S: Final = 2.0
"""Time in s after which the end of a command begins no further batch."""


def copy_at_the_end(journals: Sequence[Journal]) -> None:
    """Copy the journals to which a command added entries, if a plant is named.

    The copying has a thread of its own, so that neither a name server nor a network keeps the
    command longer. A thread that is left over ends with the process, and the plant undoes the
    batch that was under way.
    """
    plant = named_plant()
    if plant is None or not plant.takes_copies:
        return
    copying = _Copying(journals, plant.location)
    thread = threading.Thread(target=copying.run, name="copies for the plant", daemon=True)
    thread.start()
    if copying.answered.wait(CONNECT_S):
        thread.join(COPY_S + CONNECT_S)
    copying.show(repeat=True)


def copy_journals_in_use() -> None:
    """Copy the journals that this process has open, if a plant is named; nobody waits for that."""
    plant = named_plant()
    if plant is None or not plant.takes_copies:
        return
    journals = [journal for journal in journals_in_use() if _is_here(journal)]
    if journals:
        copying = _Copying(journals, plant.location)
        copying.run()
        copying.show(repeat=False)


def _is_here(journal: Journal) -> bool:
    """Whether a journal can be read and was not moved; otherwise its next job says so."""
    try:
        journal.require_unmoved()
    except RobolinkError:
        return False
    return True


@contextmanager
def copying_meanwhile(every_s: float = PLANT_S) -> Iterator[None]:
    """Copy the journals in use now and then while the block runs, beside a fleet's agent."""
    end = runtime.regularly(every_s, copy_journals_in_use, "copies for the plant")
    try:
        yield
    finally:
        end()


class _Copying:
    """One attempt to copy journals.

    Attributes:
        answered: Set once the database has answered, or cannot.
    """

    def __init__(self, journals: Sequence[Journal], url: str) -> None:
        self.answered = threading.Event()
        self._journals = journals
        self._url = url
        self._behind = 0
        self._error: RobolinkError | None = None
        self._ended = False

    def run(self) -> None:
        """Copy; what keeps it from that is for :meth:`show`."""
        try:
            for journal in self._journals:
                if not isinstance(self._error, ConnectError):
                    self._copy(journal)
            self._ended = True
        finally:
            self.answered.set()

    def _copy(self, journal: Journal) -> None:
        try:
            with journal.outbox(self._url) as outbox:
                outbox.connect()
                self.answered.set()
                self._behind += outbox.copy(within_s=COPY_S).behind_count
        except RobolinkError as error:
            self._error = error  # one journal that is not copied keeps no other back

    def show(self, *, repeat: bool) -> None:
        """Show what a person has to know.

        Args:
            repeat: Whether it is shown at each command. That the database is away is shown once,
                until it is back.
        """
        error = self._error
        if not self._ended:
            error = self._unfinished()
        shown = state_folder("plant") / "shown"
        once = isinstance(error, ConnectError) or not repeat
        kind = type(error).__name__ if error is not None else ""
        if error is not None and not (once and kind == _noted(shown)):
            note(str(error))
        if error is None and self._behind and repeat:
            note(
                tr(
                    "{count} entries are still to be copied to the plant: robolink journal sync",
                    count=self._behind,
                )
            )
        _keep(shown, kind)

    def _unfinished(self) -> ConnectError:
        if self.answered.is_set():
            seconds = COPY_S + CONNECT_S
            what = tr(
                "Copying to the plant's database took more than {seconds:g} s.", seconds=seconds
            )
            return ConnectError(
                what, remedy=tr("The rest is copied later. To copy it now: robolink journal sync")
            )
        return ConnectError(
            tr("The plant's database did not answer within {seconds:g} s.", seconds=CONNECT_S),
            remedy=tr("The cell goes on working. Entries are copied once it answers."),
        )


def _noted(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeError):
        return ""


def _keep(path: Path, kind: str) -> None:
    """Note what was shown last; where that is impossible it is shown again."""
    with suppress(OSError):
        if not kind:
            path.unlink(missing_ok=True)
        elif _noted(path) != kind:
            make_folder(path.parent)
            write_whole(path, kind.encode())
