"""Statements about markers.

Each carries a checksum among its details, over the name of its controller too. Entries are chained
by their hashes; a marker stands alone, and recovery writes the old value that it names. Under a
name that is damaged it would block nobody, so whoever is about to change something looks at all.
"""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Final, NamedTuple

from robolink.errors import JournalError
from robolink.journal.store import statements
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import plain, tr
from robolink.model import Marker, MarkerKind
from robolink.timing import local_label


class _Stored(NamedTuple):
    """A marker as it is stored."""

    controller: str
    operation: str
    kind: str
    request: str
    begun_at: str
    details: str


_SUM: Final = "_sum"
"""Where the checksum stands. Markers of before have none, and nothing tells that one is bent; or
one that leaves the name of their controller out."""


class MarkerRows:
    """What is not settled, over one connection."""

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
        # As it will be read: other keys and numbers than JSON's are told apart no more.
        details = json.loads(canonical(plain(marker.details)))
        stored = _Stored(
            controller=values["of_controller"],
            operation=values["of_operation"],
            kind=values["kind"],
            request=values["request"],
            begun_at=values["begun_at"],
            details=canonical(details),
        )
        values["details"] = _with_sum(stored, details)
        if self._connection.run(statements.ADD_MARKER, values):
            return True
        self._connection.run(statements.CHANGE_MARKER, values)
        return False

    def remove(self, controller: str, operation: str) -> bool:
        """Forget a marker; return whether it was there."""
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
            found += [_marker(_Stored(*row)) for row in rows]
        return tuple(found)

    def of_all(self) -> tuple[tuple[str, Marker], ...]:
        """Return every marker with the identity of its controller, oldest first.

        Raises:
            JournalError: One of them is damaged.
        """
        found = [_Stored(*row) for row in self._connection.rows(statements.ALL_MARKERS)]
        return tuple([(row.controller, _marker(row)) for row in found])


def _marker(row: _Stored) -> Marker:
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
                "It says what was left unfinished, {request!r} of {when}, and may "
                "have been written by a newer robolink. Check the robot's selected "
                "tool and its tool offsets by hand, then move the journal away.",
                request=row.request,
                when=local_label(row.begun_at),
            ),
            controller=row.controller,
        ) from error
    return Marker(row.operation, kind, row.request, row.begun_at, details)


def _with_sum(row: _Stored, details: Mapping[str, object]) -> str:
    """Return the details of a marker, which its row holds without a checksum, with one."""
    return canonical({**details, _SUM: _sum_of(row)})


def _sum_of(fields: Sequence[str]) -> str:
    """Return the checksum of the fields of a marker whose details have none."""
    return sha256("\n".join(fields).encode("utf-8")).hexdigest()[:16]


def _same(controller: str, operation: str) -> dict[str, str]:
    return {"of_controller": storable(controller), "of_operation": storable(operation)}
