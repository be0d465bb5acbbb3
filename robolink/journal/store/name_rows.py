"""Statements about the names of controllers.

A controller is on record under what it says of itself. Two tables lead there: the address at
which it was met last, and the names under which earlier entries stand, which are chained and
so keep theirs.
"""

from typing import Final

from sqlalchemy import BindParameter, bindparam, func, insert, select, update

from robolink.journal.store.chain import storable
from robolink.journal.store.marker_rows import MarkerRows
from robolink.journal.store.prepared import UNLESS_THERE, Prepared, StatementRunner
from robolink.journal.store.tables import (
    ADDRESSES,
    ENTRIES,
    FORMER_NAMES,
    LEASES,
    MARKERS,
    ROBOTS,
)

_OF: Final[BindParameter[object]] = bindparam("of_name")
_TO: Final[BindParameter[object]] = bindparam("to_name")
_AT: Final = Prepared(select(ADDRESSES.c.controller).where(ADDRESSES.c.address == _OF))
_PLACES: Final = Prepared(
    select(ADDRESSES.c.address)
    .where(ADDRESSES.c.controller == _OF)
    .order_by(ADDRESSES.c.met_at.desc(), ADDRESSES.c.address)
)
_MEET: Final = Prepared(
    update(ADDRESSES)
    .where(ADDRESSES.c.address == _OF)
    .values(controller=_TO, met_at=bindparam("met_at"))
)
_FIRST_MEETING: Final = Prepared(
    insert(ADDRESSES).values(address=_OF, controller=_TO, met_at=bindparam("met_at")),
    UNLESS_THERE,
)
_SUCCESSOR: Final = Prepared(select(FORMER_NAMES.c.controller).where(FORMER_NAMES.c.name == _OF))
_FORMER: Final = Prepared(
    select(FORMER_NAMES.c.name)
    .where(FORMER_NAMES.c.controller == _OF)
    .order_by(FORMER_NAMES.c.name)
)
_SUCCEED: Final = Prepared(insert(FORMER_NAMES).values(name=_OF, controller=_TO), UNLESS_THERE)
_PASS_ON: Final = Prepared(
    update(FORMER_NAMES).where(FORMER_NAMES.c.controller == _OF).values(controller=_TO)
)
_ROBOTS_OF: Final = Prepared(
    select(ROBOTS.c.name).where(ROBOTS.c.controller == _OF).order_by(ROBOTS.c.name)
)
_ROBOT: Final = Prepared(insert(ROBOTS).values(name=_OF, controller=_TO), UNLESS_THERE)
_MOVE_ROBOT: Final = Prepared(update(ROBOTS).where(ROBOTS.c.name == _OF).values(controller=_TO))
_OTHER: Final = LEASES.alias("other")
# Where the controller has a lease under its own name, that one counts.
_MOVE_LEASE: Final = Prepared(
    update(LEASES)
    .where(
        LEASES.c.controller == _OF,
        ~select(_OTHER.c.epoch).where(_OTHER.c.controller == _TO).exists(),
    )
    .values(controller=_TO)
)
_USES: Final = tuple(
    Prepared(select(func.count()).select_from(rows).where(rows.c.controller == _OF))
    for rows in (MARKERS, LEASES)
)
_USED_ENTRY: Final = Prepared(select(ENTRIES.c.number).where(ENTRIES.c.controller == _OF).limit(1))


class NameRows:
    """Who is meant by a name or an address, over one connection.

    Args:
        runner: Runs statements.
        known: Whether the journal has these tables: one that an older robolink made, opened
            for reading only, has none, and there each name is its own.
        robots_known: Whether it has that of the robots.
    """

    def __init__(self, runner: StatementRunner, *, known: bool, robots_known: bool) -> None:
        self._runner = runner
        self._known = known
        self._robots_known = robots_known

    def at(self, address: str) -> str:
        """Return who was met last at an address, empty for nobody."""
        return self._one(_AT, address)

    def addresses_of(self, controller: str) -> tuple[str, ...]:
        """Return the addresses at which a controller was met last, the latest first."""
        return self._all(_PLACES, controller)

    def meant(self, name: str) -> str:
        """Return the controller that an address or a name leads to now, else the name itself."""
        return self.at(name) or self.successor(name) or name

    def successor(self, name: str) -> str:
        """Return whose entries those under ``name`` are, empty when nobody's but its own."""
        return self._one(_SUCCESSOR, name)

    def former(self, controller: str) -> tuple[str, ...]:
        """Return the other names under which a controller has entries."""
        return self._all(_FORMER, controller)

    def robots(self, controller: str) -> tuple[str, ...]:
        """Return the names under which robots of a controller have entries of their own."""
        return self._all(_ROBOTS_OF, controller) if self._robots_known else ()

    def in_use(self, name: str) -> bool:
        """Whether anything is on record under ``name`` itself."""
        values = {"of_name": storable(name)}
        if any(self._runner.rows(use, values)[0][0] for use in _USES):
            return True
        return bool(self._runner.rows(_USED_ENTRY, values))

    def meet(self, address: str, controller: str, met_at: str) -> None:
        """Note who was met at an address."""
        values = {**_pair(address, controller), "met_at": met_at}
        if not self._runner.run(_FIRST_MEETING, values):
            self._runner.run(_MEET, values)

    def carry_over(self, name: str, controller: str) -> bool:
        """Make a controller the owner of what is on record under ``name``.

        Returns:
            Whether it was nobody's before.
        """
        values = _pair(name, controller)
        if not self._runner.run(_SUCCEED, values):
            return False
        for statement in (_PASS_ON, _MOVE_LEASE):
            self._runner.run(statement, values)
        MarkerRows(self._runner).rename(name, controller)
        return True

    def note_robot(self, robot: str, controller: str) -> None:
        """Make a robot one of a controller's; what is open under its name goes there too.

        Entries stay the robot's. A marker or a lease under its name is from when it was the
        only robot of that controller, and they hold for the whole controller.
        """
        values = _pair(robot, controller)
        if not self._runner.run(_ROBOT, values):
            self._runner.run(_MOVE_ROBOT, values)
        self._runner.run(_MOVE_LEASE, values)
        MarkerRows(self._runner).rename(robot, controller)

    def _one(self, statement: Prepared, name: str) -> str:
        rows = self._runner.rows(statement, {"of_name": storable(name)}) if self._known else ()
        return str(rows[0][0]) if rows else ""

    def _all(self, statement: Prepared, name: str) -> tuple[str, ...]:
        rows = self._runner.rows(statement, {"of_name": storable(name)}) if self._known else ()
        return tuple([str(row[0]) for row in rows])


def _pair(name: str, controller: str) -> dict[str, object]:
    return {"of_name": storable(name), "to_name": storable(controller)}
