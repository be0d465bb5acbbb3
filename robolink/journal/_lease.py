"""One user at a time on a controller: a lease with an epoch.

Source: docs/reference/rules.md 6; docs/reference/faults.md F46, F47.

The epoch counts who held the lease. Whoever writes an intent proves in the same transaction
that the epoch still is his own, so a holder that was frozen and comes back is told, and sends
nothing. Whether a holder still lives is judged by what is certain first: a process that has
ended is gone; else he counts as silent when his beats stood still for :data:`LEASE_S`.
"""

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from robolink.errors import JournalError, LeaseHeldError, LeaseLostError
from robolink.journal._lease_view import FREE, LEASE_S, LeaseHolder, LeaseView
from robolink.journal.store.chain import canonical, storable
from robolink.journal.store.failures import reason_of
from robolink.journal.store.reserve import END_FRAMES, JOB_FRAMES
from robolink.messages import in_english, tr
from robolink.model import NewEntry, new_operation
from robolink.package_log import PackageLog
from robolink.timing import NS_PER_S, Clock, Deadline, wall_label

if TYPE_CHECKING:
    from robolink.journal.store.state_rows import LeaseRows
    from robolink.journal.store.store import Store

_LOG: Final = PackageLog(__package__)

BEAT_S: Final = 1.0
"""Shortest interval between two signs of life of a holder, in s."""


@dataclass(frozen=True, slots=True)
class Grip:
    """Result of asking for the lease inside a transaction.

    Attributes:
        epoch: The epoch under which it is held.
        entries: What is recorded about it.
    """

    epoch: int
    entries: tuple[NewEntry, ...] = ()


class Lease:
    """The lease of one controller, as one log sees it.

    Attributes:
        controller: Identity of the controller.

    Args:
        store: The journal's database.
        controller: Identity of the controller.
        holder: This process.
        clock: In which beats are stamped and watched.
    """

    def __init__(self, store: "Store", controller: str, holder: LeaseHolder, clock: Clock) -> None:
        self.controller = controller
        self._store = store
        self._holder = holder
        self._clock = clock
        self._token = new_operation()
        self._epoch = 0
        self._beaten_ns = 0
        self._lost = False
        self._taken = LeaseView()  # as it was when the loss was noticed
        self._seen: tuple[LeaseView, str] | None = None  # and why its holder may be replaced

    @property
    def held(self) -> bool:
        """Whether it is this log's, as far as this log knows."""
        return self._epoch != 0

    def look(self, *, afresh: bool = True) -> None:
        """Remember the lease as it is now; the next intent confirms one that is held.

        Args:
            afresh: Whether one that was lost may be forgotten.

        Raises:
            LeaseHeldError: Somebody else holds it and lives.
            LeaseLostError: It was lost, and that is not to be forgotten.
            JournalError: It cannot be read.
        """
        if self._lost and not afresh:
            raise self._lost_error()
        if not self.held:
            self._seen, self._lost = self._judged(self._sight()), False

    def at_work(self) -> str:
        """Return who else has it locked and is alive, in sentences; empty for nobody.

        A holder on another computer is not watched for that, so whether he lives stays open.

        Raises:
            JournalError: It cannot be read.
        """
        seen = self.taken_by_another()
        if seen is None:
            return ""
        who = seen.who()
        if not self._holder.shares_clock_with(who):
            return seen.at_work(tr("Watch it for a while to find out whether it is still working."))
        silent_s = self._silent_s(seen)
        if silent_s >= LEASE_S or self._holder.proves_gone(who):
            return ""
        return seen.at_work(
            tr(
                "It is still working: it last responded {seconds:.0f} s ago.",
                seconds=silent_s,
            )
        )

    def taken_by_another(self) -> LeaseView | None:
        """Return the lease as it is now if another has it, alive or not.

        Raises:
            JournalError: It cannot be read.
        """
        seen = self._sight()
        return None if seen.token in (FREE, self._token) else seen

    def refuse_holder(self, *, silent: bool) -> None:
        """Refuse while another process of this computer has it and responds, or is silent.

        Only one that is known to run. Nothing is watched and nothing noted.

        Raises:
            LeaseHeldError: One has it.
            JournalError: It cannot be read.
        """
        seen = self.taken_by_another()
        if seen is None or not self._holder.knows_to_run(seen.who()):
            return
        silent_s = self._silent_s(seen)
        if silent and silent_s >= LEASE_S:
            raise seen.silent_error(self.controller, silent_s)
        if not silent and silent_s < LEASE_S:
            raise self._held_error(seen)

    def prepare(self) -> None:
        """Look, unless that was done or the lease is held; outside of any transaction."""
        if not self.held and not self._lost and self._seen is None:
            self.look()

    def secure(self, rows: "LeaseRows", purpose: str, operator: str) -> Grip:
        """Confirm or take the lease, inside the caller's transaction.

        Raises:
            LeaseHeldError: Somebody else took it since it was looked at.
            LeaseLostError: Somebody else took it from this log, or held it meanwhile.
        """
        now_ns = self._clock.now_ns()
        if self.held and rows.renew(self.controller, self._epoch, self._token, now_ns):
            self._beaten_ns = now_ns
            return Grip(self._epoch)
        if self.held or self._lost or self._seen is None:
            self._lose(rows)
            raise self._lost_error()
        (seen, because), self._seen = self._seen, None
        claim = self._claim(purpose, operator, now_ns)
        epoch = rows.take(self.controller, seen, claim)
        if epoch == 0:
            now = self._taken = rows.sight(self.controller)
            raise self._held_error(now) if now.token != FREE else self._lost_error()
        self._beaten_ns = now_ns
        return Grip(epoch, (seen.taken_entry(because),) if because else ())

    def settle(self, grip: Grip) -> None:
        """Note, after the commit, that the lease is held."""
        if self._epoch != grip.epoch:
            over = "".join(f", over from another: {in_english(e.verdict)}" for e in grip.entries)
            self._decided(f"lease taken, epoch {grip.epoch}{over}")
        self._epoch = grip.epoch

    def beat(self) -> None:
        """Give a sign of life if the last one is old enough; a lost lease is only noted.

        Raises:
            JournalError: It cannot be stored.
        """
        now_ns = self._clock.now_ns()
        if not self.held or now_ns - self._beaten_ns < BEAT_S * NS_PER_S:
            return
        self._beaten_ns = now_ns
        try:
            self._beat(now_ns, JOB_FRAMES)
        except JournalError as error:
            cause = error.__cause__
            if cause is None or reason_of(cause) != "full":
                raise
            # With that error the log began anew, if it could. If not, signs of life may take what
            # is meant for the steps of a job, and leave what is meant for its end.
            self._beat(now_ns, END_FRAMES)

    def _beat(self, now_ns: int, leaves: int) -> None:
        with self._store.write(leaves=leaves) as tables:
            if not tables.leases.renew(self.controller, self._epoch, self._token, now_ns):
                self._lose(tables.leases)

    def release(self, rows: "LeaseRows") -> bool:
        """Free it inside the caller's transaction; a lost one is left alone.

        Returns:
            Whether it was not lost.
        """
        if self.held:
            return rows.release(self.controller, self._epoch, self._token)
        return not self._lost

    def prove(self, rows: "LeaseRows", *, last: bool) -> None:
        """Confirm inside the caller's transaction that it was not lost, before an end is recorded.

        Args:
            rows: Of the transaction.
            last: Whether it is freed with that.

        Raises:
            LeaseLostError: Somebody else has taken it, so what was true here need not be now.
        """
        kept = self.release(rows) if last else self._renewed(rows)
        if not kept:
            self._lose(rows)
            raise self._lost_error(sent=True)

    def forget(self) -> None:
        """Note, after the commit, that it was freed, and forget what was read before."""
        self._epoch, self._seen = 0, None

    def end(self, rows: "LeaseRows", reason: str, operator: str) -> NewEntry | None:
        """End the lease, whoever has it, inside the caller's transaction.

        Returns:
            What is recorded; ``None`` when this log holds it itself.
        """
        seen = rows.sight(self.controller)
        if seen.token == self._token:
            return None
        self._decided(f"lease taken away from its holder: {in_english(reason)}")
        rows.end(self.controller, self._claim(reason, operator, self._clock.now_ns()))
        insisting = replace(self._holder, operator=operator or self._holder.operator)
        return seen.taken_entry(reason, insisting)

    def _judged(self, seen: LeaseView) -> tuple[LeaseView, str]:
        """Return a lease that can be taken, and why if it is another's; or raise LeaseHeldError."""
        if seen.token in (FREE, self._token):
            return seen, ""
        who = seen.who()
        if self._holder.proves_gone(who):
            return seen, tr("its process has ended")
        if not self._holder.shares_clock_with(who):
            seen = self._watched(seen)
        elif self._silent_s(seen) < LEASE_S:
            raise self._held_error(seen)
        if seen.token == FREE:
            return seen, ""
        return seen, tr("it did not respond for {seconds:.0f} s", seconds=LEASE_S)

    def _watched(self, seen: LeaseView) -> LeaseView:
        """Watch a holder whose clock cannot be read here."""
        deadline = Deadline.after(self._clock, LEASE_S)
        while not deadline.expired:
            self._clock.sleep(BEAT_S)
            now = self._sight()
            if now.token == FREE:
                return now
            if not now.is_like(seen):
                raise self._held_error(now)
        return seen

    def _silent_s(self, seen: LeaseView) -> float:
        """Return for how long a holder of this computer has been silent, s."""
        return max(0, self._clock.now_ns() - seen.beat_ns) / NS_PER_S

    def _sight(self) -> LeaseView:
        with self._store.read(tr("The command was not sent.")) as tables:
            return tables.leases.sight(self.controller)

    def _claim(self, purpose: str, operator: str, now_ns: int) -> dict[str, object]:
        return {
            "token": self._token,
            "holder": _holder_text(self._holder, operator or self._holder.operator),
            "boot": storable(self._holder.boot),
            "beat_ns": now_ns,
            "taken_at": wall_label(),
            "purpose": storable(purpose),
        }

    def _decided(self, text: str) -> None:
        _LOG.decided(text, controller=self.controller, request="lease")

    def _renewed(self, rows: "LeaseRows") -> bool:
        if self.held:
            now_ns = self._clock.now_ns()
            return rows.renew(self.controller, self._epoch, self._token, now_ns)
        return not self._lost

    def _lose(self, rows: "LeaseRows") -> None:
        if not self._lost:
            self._taken = rows.sight(self.controller)
            self._decided("lease lost: somebody else took it")
        self._epoch, self._lost = 0, True

    def _held_error(self, seen: LeaseView) -> LeaseHeldError:
        who = seen.who()
        self._decided(f"lease refused: {who.operator or 'somebody else'} has it")
        if self._holder.shares_clock_with(who):
            sign = tr("{seconds:.0f} s ago", seconds=self._silent_s(seen))
        else:
            sign = tr("while it was watched just now")
        return seen.held_error(self.controller, sign)

    def _lost_error(self, *, sent: bool = False) -> LeaseLostError:
        """Return the error that says who took it.

        Args:
            sent: Whether it is about the end of something that was sent before.
        """
        return LeaseLostError(
            self._taken.took_over(self.controller),
            remedy=tr(
                "The job stays open. Read the tools again. Who did what: robolink journal list"
            )
            if sent
            else tr("Nothing was sent. Read the tool again. Who did what: robolink journal list"),
            controller=self.controller,
        )


@lru_cache(maxsize=64)
def _holder_text(holder: LeaseHolder, operator: str) -> str:
    return canonical({**asdict(holder), "operator": operator})
