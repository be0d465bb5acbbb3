"""The record of a controller for somebody who only looks: opened when there is a reason to.

Nearly always nothing is unfinished, and SQLAlchemy takes several times as long to load as a look
at a controller. So an SQLite file is asked by itself: is anything unfinished or at work, on any
controller, and has this address been met before? No and yes are believed; all else, and any
trouble with the file, opens the journal as for everybody.
"""

import json
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, closing
from typing import Any, Final, NamedTuple

from robolink.errors import ConfigError
from robolink.journal._opening import open_log
from robolink.journal._places import default_location, place_of
from robolink.journal._processes import this_process
from robolink.journal._runs import forget_client, note_client, run_of
from robolink.journal._traces import traces_of
from robolink.model import (
    NO_HISTORY,
    ClientRun,
    EntryKind,
    Marker,
    NewEntry,
    OutcomeLog,
    Recorded,
    Signature,
    Who,
)

_QUESTION: Final = """
    SELECT
        EXISTS (SELECT 1 FROM markers) OR EXISTS (SELECT 1 FROM leases WHERE token <> ''),
        (SELECT controller FROM addresses WHERE address = ?)
"""
_NAMES: Final = """
    SELECT DISTINCT tool, station FROM entries
    WHERE ? = '' OR controller IN (
        SELECT controller FROM addresses WHERE address = ?
        UNION SELECT robots.name FROM robots
            JOIN addresses ON addresses.controller = robots.controller WHERE address = ?
        UNION VALUES (?)
    )
"""
_HISTORY: Final = """
    SELECT 1 FROM entries WHERE controller IN (
        SELECT ? UNION SELECT name FROM robots WHERE controller = ?
        UNION SELECT name FROM former_names WHERE controller = ?
    ) AND kind NOT IN (SELECT value FROM json_each(?)) LIMIT 1
"""
_WAIT_S: Final = 1.0
"""Longest wait for another process that writes; after it the journal says what is the matter."""


class GlancingLog:
    """Stands in for a log until something is unfinished, or has to be recorded.

    Attributes:
        signature: Who works here, and with what.

    Args:
        address: How the controller is reached.
        signature: Who works here.
    """

    def __init__(self, address: str, *, signature: Signature) -> None:
        self.signature = signature
        self._address = address
        self._who: Who | None = None
        self._opened: OutcomeLog | None = None

    @property
    def change(self) -> str:
        """Id of the tool change under way; see the model."""
        return "" if self._opened is None else self._opened.change

    @change.setter
    def change(self, change: str) -> None:
        self._log().change = change

    @property
    def order(self) -> str:
        """Id of the order that is carried out; see the model."""
        return "" if self._opened is None else self._opened.order

    @order.setter
    def order(self, order: str) -> None:
        self._log().order = order

    @property
    def trouble(self) -> ConfigError | None:
        """Why nothing can be recorded, as far as anybody had to know."""
        if self._opened is None and nothing_is_open(self._address):
            return None
        return self._log().trouble

    @property
    def durable(self) -> bool:
        """True: only such a record is glanced at."""
        return True

    @property
    def identity(self) -> str:
        """See the model."""
        return self._log().identity

    @property
    def names(self) -> tuple[str, ...]:
        """See the model."""
        return self._log().names

    @property
    def robot(self) -> str:
        """See the model."""
        return self._log().robot

    @property
    def remarks(self) -> tuple[str, ...]:
        """Nothing, unless the journal was opened."""
        return () if self._opened is None else self._opened.remarks

    def ask(self, who: Who) -> None:
        """Let the controller say who it is, when the journal is opened."""
        self._who = who
        if self._opened is not None:
            self._opened.ask(who)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled; the journal is opened if anything is."""
        if self._opened is None and nothing_is_open(self._address):
            return ()
        return self._log().open_markers()

    def at_work(self) -> str:
        """Return who else is working on the controller; empty for nobody."""
        if self._opened is None and nothing_is_open(self._address):
            return ""
        return self._log().at_work()

    def begin(self, marker: Marker) -> None:
        """See the model."""
        self._log().begin(marker)

    def clear(self, operation: str, *entries: NewEntry) -> None:
        """See the model."""
        self._log().clear(operation, *entries)

    def append(self, *entries: NewEntry) -> None:
        """See the model."""
        self._log().append(*entries)

    def answered(self, entry: NewEntry) -> None:
        """See the model."""
        self._log().answered(entry)

    def look(self) -> None:
        """See the model."""
        self._log().look()

    def hold(self, purpose: str) -> AbstractContextManager[None]:
        """See the model."""
        return self._log().hold(purpose)

    def take_over(self, reason: str) -> None:
        """See the model."""
        self._log().take_over(reason)

    def note_client(self, client: str) -> None:
        """See the model; no journal is opened for that."""
        note_client(client, this_process(self.signature.operator))

    def forget_client(self, client: str) -> None:
        """See the model."""
        forget_client(client)

    def run_of(self, client: str) -> ClientRun | None:
        """See the model."""
        return run_of(client, this_process())

    def beat(self) -> None:
        """See the model; nobody waits for the sign of one who has begun nothing."""
        if self._opened is not None:
            self._opened.beat()

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """See the model."""
        return self._log().recorded(tool=tool, change=change, kinds=kinds)

    def close(self) -> None:
        """See the model."""
        if self._opened is not None:
            self._opened.close()

    def _log(self) -> OutcomeLog:
        if self._opened is None:
            self._opened = open_log(self._address, durable=True, signature=self.signature)
            if self._who is not None:
                self._opened.ask(self._who)
        return self._opened


class NamesOnRecord(NamedTuple):
    """What a journal has entries about.

    Attributes:
        tools: Numbers of tools, in their order.
        stations: Ids of stations, in the order of the alphabet.
    """

    tools: tuple[int, ...] = ()
    stations: tuple[str, ...] = ()


def names_on_record(address: str) -> NamesOnRecord:
    """Return the tools and stations on record, for TAB: no database code but Python's is loaded.

    Args:
        address: How the controller is reached; empty for all controllers.

    Returns:
        Nothing where the journal is on a server, or its file is missing or cannot be read.
    """
    rows = _asked(_NAMES, (address,) * 4)
    return NamesOnRecord(
        tuple(sorted({tool for tool, _ in rows if isinstance(tool, int)})),
        tuple(sorted({str(station) for _, station in rows if station})),
    )


def nothing_is_open(address: str) -> bool:
    """Tell whether the journal is a readable file that has nothing to say about a look.

    Args:
        address: How the controller is reached. One that was not met there before is asked who
            it is, and what follows from that is said. So is one that was changed from here, where
            this journal might not be its record.

    Returns:
        False also where that cannot be told; a server is not asked.
    """
    ((unfinished, known),) = _asked(_QUESTION, (address,)) or [(True, None)]
    return bool(known) and not unfinished and _is_its_record(str(known))


def _is_its_record(name: str) -> bool:
    """Whether nothing shows that what was done to a controller is on record elsewhere, or lost."""
    traces = traces_of((name,))
    if traces is None:
        return True
    kept_here = traces.journal in ("", place_of(default_location()).location)
    return kept_here and bool(_asked(_HISTORY, (name, name, name, json.dumps(NO_HISTORY))))


def _asked(question: str, values: tuple[str, ...]) -> list[tuple[Any, ...]]:
    """Return the rows that an SQLite file answers; none where there is none, or it is not well."""
    try:
        path = place_of(default_location()).path
        if path is None or not path.exists():
            return []
        uri = f"{path.absolute().as_uri()}?mode=ro"
        with closing(sqlite3.connect(uri, uri=True, timeout=_WAIT_S)) as file:
            return file.execute(question, values).fetchall()
    except (ConfigError, OSError, ValueError, sqlite3.Error):
        return []
