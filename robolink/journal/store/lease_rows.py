"""Statements about leases."""

from collections.abc import Mapping

from robolink.journal._sightings import FREE, LeaseSighting
from robolink.journal.store import statements
from robolink.journal.store.chain import storable
from robolink.journal.store.connection import DatabaseConnection


class LeaseRows:
    """Who may change which controller, over one connection."""

    def __init__(self, connection: DatabaseConnection) -> None:
        self._connection = connection

    def sight(self, controller: str) -> LeaseSighting:
        """Return the lease as it is now; one that never was held is free."""
        rows = self._connection.rows(statements.LEASE, {"of_controller": storable(controller)})
        return LeaseSighting(*rows[0]) if rows else LeaseSighting()

    def renew(self, controller: str, epoch: int, token: str, now_ns: int) -> bool:
        """Count one more beat; return whether the lease still is this holder's."""
        values = {**_own(controller, epoch, token), "now_ns": now_ns}
        return self._connection.run(statements.RENEW_LEASE, values) == 1

    def release(self, controller: str, epoch: int, token: str) -> bool:
        """Free the lease; return whether it was this holder's, and leave it alone if not."""
        return self._connection.run(statements.RELEASE_LEASE, _own(controller, epoch, token)) == 1

    def take(self, controller: str, seen: LeaseSighting, claim: Mapping[str, object]) -> int:
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
        """Free the lease whoever holds it, so that he notices, and note who did that and why."""
        values = {"of_controller": storable(controller), **claim, "token": FREE}
        self._connection.run(statements.END_LEASE, values)


def _own(controller: str, epoch: int, token: str) -> dict[str, object]:
    return {"of_controller": storable(controller), "of_epoch": epoch, "of_token": token}
