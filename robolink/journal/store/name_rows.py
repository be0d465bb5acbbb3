"""Statements about the names of controllers.

A controller is on record under what it says of itself. Two tables lead there: the address at
which it was met last, and the names under which earlier entries stand, which are chained and
so keep theirs.
"""

from robolink.journal.store import statements
from robolink.journal.store.chain import storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.journal.store.marker_rows import MarkerRows


class NameRows:
    """Who is meant by a name or an address, over one connection.

    Args:
        connection: To the database.
        known: Whether the journal has these tables: one that an older robolink made, opened
            for reading only, has none, and there each name is its own.
        robots_known: Whether it has that of the robots.
    """

    def __init__(self, connection: DatabaseConnection, *, known: bool, robots_known: bool) -> None:
        self._connection = connection
        self._known = known
        self._robots_known = robots_known

    def at(self, address: str) -> str:
        """Return who was met last at an address, empty for nobody."""
        return self._one(statements.MET_AT, address)

    def addresses_of(self, controller: str) -> tuple[str, ...]:
        """Return the addresses at which a controller was met last, the latest first."""
        return self._all(statements.PLACES_OF, controller)

    def meant(self, name: str) -> str:
        """Return the controller that an address or a name leads to now, else the name itself."""
        return self.at(name) or self.successor(name) or name

    def all_of(self, name: str) -> tuple[str, ...]:
        """Return every name under which the controller that is meant is on record, its own first.

        Of one with several robots that is all of them.
        """
        identity = self.meant(name)
        return (identity, *self.former(identity), *self.robots(identity))

    def successor(self, name: str) -> str:
        """Return whose entries those under ``name`` are, empty when nobody's but its own."""
        return self._one(statements.SUCCESSOR, name)

    def former(self, controller: str) -> tuple[str, ...]:
        """Return the other names under which a controller has entries."""
        return self._all(statements.FORMER_NAMES, controller)

    def robots(self, controller: str) -> tuple[str, ...]:
        """Return the names under which robots of a controller have entries of their own."""
        return self._all(statements.ROBOTS_OF, controller) if self._robots_known else ()

    def in_use(self, name: str) -> bool:
        """Whether anything is on record under ``name`` itself."""
        values = {"of_name": storable(name)}
        return any(
            self._connection.rows(use, values)
            for use in (statements.MARKER_OR_LEASE_OF, statements.ENTRY_OF)
        )

    def meet(self, address: str, controller: str, met_at: str) -> None:
        """Note who was met at an address."""
        values = {**_pair(address, controller), "met_at": met_at}
        if not self._connection.run(statements.MEET_FIRST, values):
            self._connection.run(statements.MEET_AGAIN, values)

    def carry_over(self, name: str, controller: str) -> bool:
        """Make a controller the owner of what is on record under ``name``.

        Returns:
            Whether it was nobody's before.
        """
        values = _pair(name, controller)
        if not self._connection.run(statements.SUCCEED, values):
            return False
        for statement in (statements.PASS_ON, statements.MOVE_LEASE):
            self._connection.run(statement, values)
        MarkerRows(self._connection).rename(name, controller)
        return True

    def note_robot(self, robot: str, controller: str) -> None:
        """Make a robot one of a controller's; what is open under its name goes there too.

        Entries stay the robot's. A marker or a lease under its name is from when it was the
        only robot of that controller, and they hold for the whole controller.
        """
        values = _pair(robot, controller)
        if not self._connection.run(statements.ADD_ROBOT, values):
            self._connection.run(statements.MOVE_ROBOT, values)
        self._connection.run(statements.MOVE_LEASE, values)
        MarkerRows(self._connection).rename(robot, controller)

    def _one(self, statement: str, name: str) -> str:
        rows = self._connection.rows(statement, {"of_name": storable(name)}) if self._known else ()
        return str(rows[0][0]) if rows else ""

    def _all(self, statement: str, name: str) -> tuple[str, ...]:
        rows = self._connection.rows(statement, {"of_name": storable(name)}) if self._known else ()
        return tuple([str(row[0]) for row in rows])


def _pair(name: str, controller: str) -> dict[str, object]:
    return {"of_name": storable(name), "to_name": storable(controller)}
