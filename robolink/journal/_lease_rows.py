"""Statements about leases."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Final

from sqlalchemy import BindParameter, Connection, bindparam, insert, select, update
from sqlalchemy.exc import IntegrityError

from robolink.journal._chain import storable
from robolink.journal._prepared import Prepared
from robolink.journal._sightings import FREE, Sighting
from robolink.journal._tables import LEASES

_SEEN: Final = tuple(field.name for field in fields(Sighting))
_OF: Final = LEASES.c.controller == bindparam("of_controller")
_OURS: Final = (
    _OF,
    LEASES.c.epoch == bindparam("of_epoch"),
    LEASES.c.token == bindparam("of_token"),
)
_CLAIM: Final[dict[str, BindParameter[object]]] = {
    name: bindparam(name) for name in ("token", "holder", "boot", "beat_ns", "taken_at", "purpose")
}
_SELECT: Final = Prepared(select(*(LEASES.c[name] for name in _SEEN)).where(_OF))
_RENEW: Final = Prepared(
    update(LEASES).where(*_OURS).values(beat=LEASES.c.beat + 1, beat_ns=bindparam("now_ns"))
)
_RELEASE: Final = Prepared(update(LEASES).where(*_OURS).values(token=FREE))
_TAKE: Final = Prepared(
    update(LEASES)
    .where(*_OURS, LEASES.c.beat == bindparam("of_beat"))
    .values(epoch=LEASES.c.epoch + 1, **_CLAIM)
)
_END: Final = Prepared(update(LEASES).where(_OF).values(epoch=LEASES.c.epoch + 1, token=FREE))
_INSERT: Final = Prepared(insert(LEASES))


class LeaseRows:
    """Who may change which controller, over one connection."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def sight(self, controller: str) -> Sighting:
        """Return the lease as it is now; one that never was held is free."""
        row = _SELECT.run(self._connection, {"of_controller": storable(controller)}).first()
        return Sighting() if row is None else Sighting(*row)

    def renew(self, controller: str, epoch: int, token: str, now_ns: int) -> bool:
        """Count one more beat; return whether the lease still is this holder's."""
        values = {**_own(controller, epoch, token), "now_ns": now_ns}
        return _RENEW.run(self._connection, values).rowcount == 1

    def release(self, controller: str, epoch: int, token: str) -> None:
        """Free the lease; one that was lost is left alone."""
        _RELEASE.run(self._connection, _own(controller, epoch, token))

    def take(self, controller: str, seen: Sighting, claim: Mapping[str, object]) -> int:
        """Take the lease if it still is as it was seen.

        Returns:
            The new epoch, or 0 when it changed meanwhile.
        """
        if seen.epoch == 0:
            first = {"controller": storable(controller), "epoch": 1, "beat": 0}
            try:
                with self._connection.begin_nested():
                    _INSERT.run(self._connection, {**first, **claim})
            except IntegrityError:
                return 0
            return 1
        values = {**_own(controller, seen.epoch, seen.token), "of_beat": seen.beat, **claim}
        return seen.epoch + 1 if _TAKE.run(self._connection, values).rowcount else 0

    def end(self, controller: str) -> None:
        """Free the lease whoever holds it, so that he notices."""
        _END.run(self._connection, {"of_controller": storable(controller)})


def _own(controller: str, epoch: int, token: str) -> dict[str, object]:
    return {"of_controller": storable(controller), "of_epoch": epoch, "of_token": token}
