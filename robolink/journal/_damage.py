"""A look for damage before the first write: cheap, and so not at the whole journal.

SQLite keeps no checksums: a page that a disk or a person bent reads as if it were right. What a
change rests on is looked at: the tables of markers and leases as a whole, the newest entries of
the journal and those of the controller. ``verify`` reads the rest.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from robolink.journal._chain import ChainCheck
from robolink.journal._records import Filter
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.journal.store.store import Tables

_NEWEST: Final = 20
"""How many entries are looked at, of the journal and of the controller."""


def damage(tables: "Tables", names: tuple[str, ...]) -> Iterator[str]:
    """Yield what is wrong with what a change of a controller would rest on, in sentences.

    Args:
        tables: The journal.
        names: Of the controller.
    """
    for check in tables.self_checks:
        for (answer,) in tables.runner.rows(check):
            if answer != "ok":
                yield tr("A table is damaged: {text}.", text=str(answer).strip().rstrip("."))
    newest, head = tables.entries.settled(
        lambda: tables.entries.page(Filter(), before=None, after=None, limit=_NEWEST)
    )
    chain = ChainCheck.before(newest[-1]) if newest else ChainCheck()
    for row in reversed(newest):
        yield from chain.problems_of(row)
    yield from chain.problems_at_end(head)
    seen = {row["number"] for row in newest}
    own = tables.entries.page(Filter(names), before=None, after=None, limit=_NEWEST)
    for row in own:
        if row["number"] not in seen:
            yield from ChainCheck.before(row).problems_of(row)
