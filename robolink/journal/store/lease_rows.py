"""Statements about leases."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Final

from sqlalchemy import BindParameter, bindparam, insert, select, update

from robolink.journal._sightings import FREE, LeaseSighting
from robolink.journal.store.chain import storable
from robolink.journal.store.prepared import UNLESS_THERE, Prepared, StatementRunner
from robolink.journal.store.tables import LEASES

_SEEN: Final = tuple(field.name for field in fields(LeaseSighting))
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
_END: Final = Prepared(
    update(LEASES).where(_OF).values(epoch=LEASES.c.epoch + 1, **{**_CLAIM, "token": FREE})
)
_INSERT: Final = Prepared(insert(LEASES), UNLESS_THERE)


class LeaseRows:
    """Who may change which controller, over one connection."""

    def __init__(self, runner: StatementRunner) -> None:
        self._runner = runner

    def sight(self, controller: str) -> LeaseSighting:
        """Return the lease as it is now; one that never was held is free."""
        rows = self._runner.rows(_SELECT, {"of_controller": storable(controller)})
        return LeaseSighting(*rows[0]) if rows else LeaseSighting()

    def renew(self, controller: str, epoch: int, token: str, now_ns: int) -> bool:
        """Count one more beat; return whether the lease still is this holder's."""
        values = {**_own(controller, epoch, token), "now_ns": now_ns}
        return self._runner.run(_RENEW, values) == 1

    def release(self, controller: str, epoch: int, token: str) -> bool:
        """Free the lease; return whether it was this holder's, and leave it alone if not."""
        return self._runner.run(_RELEASE, _own(controller, epoch, token)) == 1

    def take(self, controller: str, seen: LeaseSighting, claim: Mapping[str, object]) -> int:
        """Take the lease if it still is as it was seen.

        Returns:
            The new epoch, or 0 when it changed meanwhile.
        """
        if seen.epoch == 0:
            first = {"controller": storable(controller), "epoch": 1, "beat": 0, **claim}
            return self._runner.run(_INSERT, first)
        values = {**_own(controller, seen.epoch, seen.token), "of_beat": seen.beat, **claim}
        return seen.epoch + 1 if self._runner.run(_TAKE, values) else 0

    def end(self, controller: str, claim: Mapping[str, object]) -> None:
        """Free the lease whoever holds it, so that he notices, and note who did that and why."""
        values = {name: value for name, value in claim.items() if name != "token"}
        self._runner.run(_END, {"of_controller": storable(controller), **values})


def _own(controller: str, epoch: int, token: str) -> dict[str, object]:
    return {"of_controller": storable(controller), "of_epoch": epoch, "of_token": token}
