"""Several journals copied to the plant's database, some at a time."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

from robolink.errors import ConnectError, RobolinkError
from robolink.journal._connections import open_journal
from robolink.journal._outbox import ChainCopy
from robolink.journal._places import shown_location

AT_ONCE: Final = 8
"""Number of journals that are copied at the same time, each over a connection of its own."""


@dataclass(frozen=True, slots=True)
class JournalCopy:
    """What the copy of one of several journals came to.

    Attributes:
        journal: The journal, without its password.
        copy: How far it is copied now; ``None`` where that failed.
        error: Why it failed; ``None`` where it did not.
    """

    journal: str
    copy: ChainCopy | None = None
    error: RobolinkError | None = None


def copy_journals(
    journals: Sequence[str], plant: str, *, at_once: int = AT_ONCE, new_chain: bool = False
) -> Iterator[JournalCopy]:
    """Copy to the plant's database what it lacks of each journal.

    What keeps one from being copied is in its result and ends nothing else; but where the database
    does not answer, no further one is tried. Each journal is closed again.

    Args:
        journals: Paths or URLs of the journals.
        plant: URL of the plant's database.
        at_once: How many are copied at the same time.
        new_chain: Whether a journal may take the place of another one that was copied from there.

    Yields:
        The results in the order of the journals.

    Example:
        >>> from robolink.journal import copy_journals
        >>> (one,) = copy_journals(["no-such.db"], "postgresql://127.0.0.1:1/plant")
        >>> type(one.error).__name__
        'JournalError'
    """
    away: list[ConnectError] = []

    def copied(place: str) -> JournalCopy:
        if away:
            return JournalCopy(shown_location(place), error=away[0])
        try:
            journal = open_journal(place, read_only=True)
            try:
                journal.require_unmoved()
                with journal.outbox(plant) as outbox:
                    return JournalCopy(journal.location, outbox.copy(new_chain=new_chain))
            finally:
                journal.close()
        except ConnectError as error:
            away.append(error)
            return JournalCopy(shown_location(place), error=error)
        except RobolinkError as error:
            return JournalCopy(shown_location(place), error=error)

    with ThreadPoolExecutor(max(at_once, 1), thread_name_prefix="robolink-copy") as pool:
        yield from pool.map(copied, journals)
