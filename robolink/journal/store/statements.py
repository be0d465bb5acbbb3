"""What can be asked and changed over one connection to the journal's database.

SQLite keeps no checksums: a page that a disk or a person bent reads as if it were right. So before
the first write there is a look at what a change rests on: the tables of markers and leases as a
whole, the newest entries of the journal and those of the controller. It is cheap, and so not at
the whole journal; ``verify`` reads the rest.
"""

from collections.abc import Iterator
from typing import Final

from sqlalchemy import Connection

from robolink.journal._records import Filter
from robolink.journal.store import migrations
from robolink.journal.store.chain import ChainCheck
from robolink.journal.store.entry_rows import EntryRows
from robolink.journal.store.lease_rows import LeaseRows
from robolink.journal.store.marker_rows import MarkerRows
from robolink.journal.store.name_rows import NameRows
from robolink.journal.store.prepared import Prepared, StatementRunner
from robolink.messages import tr

_NEWEST: Final = 20
"""How many entries are looked at, of the journal and of the controller."""


class Tables:
    """What can be asked and changed over one connection.

    Attributes:
        connection: The connection.
        runner: Runs prepared statements over it.
        entries: The append-only record.
        markers: What is not settled.
        leases: Who may change which controller.
        names: Who is meant by a name or an address.
        newer: Whether a newer robolink made the tables.
        self_checks: Statements by which the database looks for damage.
    """

    def __init__(
        self, connection: Connection, version: int, self_checks: tuple[Prepared, ...]
    ) -> None:
        self.connection = connection
        self.runner = StatementRunner(connection)
        self.entries = EntryRows(connection, self.runner)
        self.markers = MarkerRows(self.runner)
        self.leases = LeaseRows(self.runner)
        self.names = NameRows(self.runner, known=version >= migrations.NAMED)
        self.newer = version > len(migrations.MIGRATIONS)
        self.self_checks = self_checks

    def damage(self, names: tuple[str, ...]) -> Iterator[str]:
        """Yield what is wrong with what a change of a controller would rest on, in sentences.

        Args:
            names: Of the controller.
        """
        for check in self.self_checks:
            for (answer,) in self.runner.rows(check):
                if answer != "ok":
                    yield tr("A table is damaged: {text}.", text=str(answer).strip().rstrip("."))
        newest, head = self.entries.settled(
            lambda: self.entries.page(Filter(), before=None, after=None, limit=_NEWEST)
        )
        chain = ChainCheck.before(newest[-1]) if newest else ChainCheck()
        for row in reversed(newest):
            yield from chain.problems_of(row)
        yield from chain.problems_at_end(head)
        seen = {row["number"] for row in newest}
        own = self.entries.page(Filter(names), before=None, after=None, limit=_NEWEST)
        for row in own:
            if row["number"] not in seen:
                yield from ChainCheck.before(row).problems_of(row)
