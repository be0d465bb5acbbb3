"""Statements about the present: leases, markers, and the names of controllers.

Each carries a checksum among its details, over the name of its controller too. Entries are chained
by their hashes; a marker stands alone, and recovery writes the old value that it names. Under a
name that is damaged it would block nobody, so whoever is about to change something looks at all.

A controller is on record under what it says of itself. Two tables lead there: the address at
which it was met last, and the names under which earlier entries stand, which are chained and
so keep theirs.
"""

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from typing import Any, Final, NamedTuple

from robolink.errors import JournalError
from robolink.journal._lease_view import FREE, LeaseView
from robolink.journal.store import statements
from robolink.journal.store.chain import canonical, is_json, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import plain, tr
from robolink.model import Marker, MarkerKind
from robolink.timing import local_label


class LeaseRows:
    """Who may change which controller, over one connection."""

    def __init__(self, connection: DatabaseConnection) -> None:
        self._connection = connection

    def sight(self, controller: str) -> LeaseView:
        """Return the lease as it is now; one that never was held is free."""
        rows = self._connection.rows(statements.LEASE, {"of_controller": storable(controller)})
        return LeaseView(*rows[0]) if rows else LeaseView()

    def of_all(self) -> tuple[tuple[str, LeaseView], ...]:
        """Return every lease with the identity of its controller."""
        rows = self._connection.rows(statements.ALL_LEASES)
        return tuple([(str(controller), LeaseView(*lease)) for controller, *lease in rows])

    def renew(self, controller: str, epoch: int, token: str, now_ns: int) -> bool:
        """Count one more beat; return whether the lease still is this holder's."""
        values = {**_own(controller, epoch, token), "now_ns": now_ns}
        return self._connection.run(statements.RENEW_LEASE, values) == 1

    def release(self, controller: str, epoch: int, token: str) -> bool:
        """Free the lease; return whether it was this holder's, and leave it alone if not."""
        return self._connection.run(statements.RELEASE_LEASE, _own(controller, epoch, token)) == 1

    def take(self, controller: str, seen: LeaseView, claim: Mapping[str, object]) -> int:
        """Take the lease if it still is as it was seen.

        Returns:
            The new epoch, or 0 when it changed meanwhile.
        """
        if seen.epoch == 0:
            first = {"of_controller": storable(controller), **claim}
            return self._connection.run(statements.FIRST_LEASE, first)
        values = {**_own(controller, seen.epoch, seen.token), "of_beat": seen.beat, **claim}
        return seen.epoch + 1 if self._connection.run(statements.TAKE_LEASE, values) else 0

    def end(self, controller: str, claim: Mapping[str, object]) -> None:
        """Free the lease, whoever holds it, so that the holder notices; note who did it and why."""
        values = {"of_controller": storable(controller), **claim, "token": FREE}
        self._connection.run(statements.END_LEASE, values)


def _own(controller: str, epoch: int, token: str) -> dict[str, object]:
    return {"of_controller": storable(controller), "of_epoch": epoch, "of_token": token}


class _Stored(NamedTuple):
    """A marker as it is stored."""

    controller: str
    operation: str
    kind: str
    request: str
    begun_at: str
    details: str


_SUM: Final = "_sum"
"""Key of the checksum. Earlier markers have none, so damage to them, or a missing controller name,
cannot be detected."""


class MarkerRows:
    """The unfinished jobs, over one connection."""

    def __init__(self, connection: DatabaseConnection) -> None:
        self._connection = connection

    def put(self, controller: str, marker: Marker) -> bool:
        """Store a marker in place of an earlier one of its operation.

        Returns:
            Whether there was none before.
        """
        values = {
            **_same(controller, marker.operation),
            "kind": str(marker.kind),
            "request": storable(marker.request),
            "begun_at": storable(marker.begun_at),
        }
        details: Any = plain(marker.details)
        text = canonical(details)
        if not is_json(details):  # it is stored as it will be read
            details = json.loads(text)
            text = canonical(details)
        stored = _Stored(
            controller=values["of_controller"],
            operation=values["of_operation"],
            kind=values["kind"],
            request=values["request"],
            begun_at=values["begun_at"],
            details=text,
        )
        values["details"] = _with_sum(stored, details)
        if self._connection.run(statements.ADD_MARKER, values):
            return True
        self._connection.run(statements.CHANGE_MARKER, values)
        return False

    def remove(self, controller: str, operation: str) -> bool:
        """Remove a marker; return whether it was there."""
        return self._connection.run(statements.REMOVE_MARKER, _same(controller, operation)) == 1

    def rename(self, controller: str, to: str) -> None:
        """Make the markers of a controller those of another name.

        Raises:
            JournalError: One of them is damaged.
        """
        for row in self._connection.rows(
            statements.MARKERS_OF, {"of_controller": storable(controller)}
        ):
            old = _Stored(*row)
            details = _marker(old).details
            new = old._replace(controller=storable(to), details=canonical(details))
            values = {**_same(old.controller, old.operation), "details": _with_sum(new, details)}
            self._connection.run(
                statements.RENAME_MARKER, {**values, "to_controller": new.controller}
            )

    def of(self, *names: str) -> tuple[Marker, ...]:
        """Return the markers of a controller, under each of its names, oldest first."""
        found: list[Marker] = []
        for name in names:
            rows = self._connection.rows(statements.MARKERS_OF, {"of_controller": storable(name)})
            found += map(_marker, rows)
        return tuple(found)

    def controllers(self, at_most: int) -> int:
        """Return on how many controllers something is open; it counts no further than asked."""
        rows = self._connection.rows(statements.CONTROLLERS_WITH_MARKERS, {"at_most": at_most})
        return int(rows[0][0])

    def of_all(self) -> tuple[tuple[str, Marker], ...]:
        """Return every marker with the identity of its controller, oldest first.

        Raises:
            JournalError: One of them is damaged.
        """
        found = [_Stored(*row) for row in self._connection.rows(statements.ALL_MARKERS)]
        return tuple([(row.controller, _marker(row)) for row in found])


@lru_cache(maxsize=256)
def _marker(fields: Sequence[str]) -> Marker:
    """Return the marker that a row holds; the same few rows are read before each command."""
    row = _Stored(*fields)
    try:
        kind, details = MarkerKind(row.kind), json.loads(row.details)
        if not isinstance(details, dict):
            raise TypeError
        told = details.pop(_SUM, None)
        summed = row._replace(details=canonical(details))
        if told not in (None, _sum_of(summed), _sum_of(summed[1:])):
            raise ValueError(told)
    except (ValueError, TypeError) as error:
        raise JournalError(
            tr("A safety record of {controller} cannot be read.", controller=row.controller),
            remedy=tr(
                "It is about {request!r} of {when}. Check the tools by hand, then move the "
                "journal away.",
                request=row.request,
                when=local_label(row.begun_at),
            ),
            controller=row.controller,
        ) from error
    return Marker(row.operation, kind, row.request, row.begun_at, details)


def _with_sum(row: _Stored, details: Mapping[str, object]) -> str:
    """Return the details of a marker, which its row holds without a checksum, with one."""
    told = _sum_of(row)
    if details and min(details) > _SUM:  # mostly so: the key of the checksum is the first one
        return f'{{"{_SUM}":"{told}",{row.details[1:]}'
    return canonical({**details, _SUM: told})


def _sum_of(fields: Sequence[str]) -> str:
    """Return the checksum of the fields of a marker whose details have none."""
    return sha256("\n".join(fields).encode("utf-8")).hexdigest()[:16]


def _same(controller: str, operation: str) -> dict[str, str]:
    return {"of_controller": storable(controller), "of_operation": storable(operation)}


class NameRows:
    """Who a name or an address means, over one connection.

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
        """Return who was last reached at an address, empty for nobody."""
        return self._one(statements.MET_AT, address)

    def addresses_of(self, controller: str) -> tuple[str, ...]:
        """Return the addresses at which a controller was last reached, the latest first."""
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

    def owner(self, name: str) -> str:
        """Return the controller whose record one under ``name`` is; of a robot its controller."""
        identity = self.meant(name)
        robot_of = self._one(statements.ROBOT_OF, identity) if self._robots_known else ""
        return robot_of or identity

    def in_use(self, name: str) -> bool:
        """Whether anything is on record under ``name`` itself."""
        values = {"of_name": storable(name)}
        return any(
            self._connection.rows(use, values)
            for use in (statements.MARKER_OR_LEASE_OF, statements.ENTRY_OF)
        )

    def meet(self, address: str, controller: str, met_at: str) -> None:
        """Note who was reached at an address."""
        values = {**_pair(address, controller), "met_at": met_at}
        if not self._connection.run(statements.MEET_FIRST, values):
            self._connection.run(statements.MEET_AGAIN, values)

    def carry_over(self, name: str, controller: str) -> None:
        """Make a controller the owner of what is on record under ``name``, if it has none."""
        values = _pair(name, controller)
        if not self._connection.run(statements.SUCCEED, values):
            return
        for statement in (statements.PASS_ON, statements.MOVE_LEASE):
            self._connection.run(statement, values)
        MarkerRows(self._connection).rename(name, controller)

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
