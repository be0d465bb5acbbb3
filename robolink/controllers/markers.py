"""The durable markers of one controller: stored before a command leaves, cleared when it is proved.

What keeps two procedures of this process apart stands here too.
"""

import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controller_outcome import note_outcome
from robolink.errors import (
    BusyError,
    Concerning,
    JournalError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    StoppedError,
    TransportError,
)
from robolink.messages import in_english, tr
from robolink.model import Ledger, Marker, MarkerKind, NewEntry, OutcomeLog, new_operation
from robolink.package_log import PackageLog
from robolink.stop_latch import StopLatch
from robolink.timing import local_label, wall_label

_LOG: Final = PackageLog(__package__)

_PROCEDURES: Final = frozenset({MarkerKind.SELECTION, MarkerKind.CHANGE})
_OF_A_TOOL: Final = frozenset({"tool", "select"})
"""Details of what writes, clears or selects a tool."""


class ProcedureLock:
    """Lets one thread at a time run a procedure on a controller; others are told at once.

    Args:
        identity: Which controller.
        latch: Under which no procedure begins, and none ends well.
    """

    def __init__(self, identity: str, latch: StopLatch) -> None:
        self._lock = threading.RLock()
        self._identity = identity
        self._latch = latch

    @contextmanager
    def held(self, request: str, *, calming: bool = False) -> Iterator[None]:
        """Hold the procedure lock.

        Args:
            request: What it is held for.
            calming: Whether that may go on while a stop is in force, as a reset may.

        Raises:
            BusyError: Another thread holds it.
            StoppedError: A stop is in force, or came meanwhile.
        """
        with Concerning(self._identity, request):
            if calming:
                with self._latch.calming(request), self._locked(request):
                    yield
            else:
                with self._locked(request), self._latch.watching(request):
                    yield

    @contextmanager
    def _locked(self, request: str) -> Iterator[None]:
        checkpoint(Checkpoint.PROCEDURE, request)
        if not self._lock.acquire(blocking=False):
            raise BusyError(
                tr("{request} has to wait: another operation is under way.", request=request),
                remedy=tr("Wait for it to end; stopping is possible at any time."),
            )
        try:
            yield
        finally:
            self._lock.release()


class MarkerStore:
    """Writes and clears the durable markers of one controller.

    Attributes:
        outcomes: Where they are kept.
        ledger: What became of what was begun here; it is told before they are.

    Args:
        identity: Which controller.
        outcomes: Where the markers are kept.
        latch: Knows whether a thread puts back what was in force before. That goes on when the
            journal fails in the middle: the marker of the procedure, which names what is to be
            put back, is stored, and nothing but the old state comes of it.
        simulated: Tells whether the controller has said by now that nothing real moves; what
            writes carries it, so that no record of it passes for one of a real machine.
    """

    def __init__(
        self,
        identity: str,
        outcomes: OutcomeLog,
        latch: StopLatch,
        *,
        simulated: Callable[[], bool] = bool,
    ) -> None:
        self._identity = identity
        self._latch = latch
        self._simulated = simulated
        self._unstored: set[str] = set()
        self.outcomes = outcomes
        self.ledger = Ledger()
        self._procedures: dict[MarkerKind, Marker] = {}
        self._under_way: dict[str, MarkerKind] = {}

    def look(self) -> None:
        """Note the state of the lease before a value is read that a write will rely on.

        Raises:
            LeaseHeldError: Somebody else is changing this controller.
        """
        self._recorded(self.outcomes.look)

    def beat(self) -> None:
        """Let others see that this process is alive."""
        self.outcomes.beat()

    @property
    def moving(self) -> bool:
        """Whether a movement was begun here whose end is not proved."""
        return MarkerKind.MOVE in self._under_way.values()

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store a marker durably: a new one, or one of before whose work is taken up again.

        Whatever writes, moves or begins a procedure passes here, in a driver of anybody's. So this
        is where it is refused after a stop, while something earlier is unsettled, and, of a tool,
        while the robot moves (docs/reference/rules.md 1, 2, 5). Only what puts back an earlier
        state goes on, and the work of a marker of before.

        Args:
            kind: What it stands for.
            request: What is begun, as a person may read it.
            details: Plain JSON values needed to settle it.
            operation: Id of the marker of before; empty for a new one.

        Raises:
            ConfigError: That is impossible.
            BusyError: Another process has the controller, or a movement is under way here.
            StoppedError: A stop is in force.
            OutcomeUnknownError: Something earlier is unsettled; nothing may be sent.
            LeaseLostError: Somebody else was at it and has just ended.
        """
        if not operation and not self._latch.restores:
            self._latch.require_open(request)
            if kind is MarkerKind.SET and not _OF_A_TOOL.isdisjoint(details):
                self._refuse_while_moving(request)
            if self._unsettled(self._under_way):
                self._refuse_unsettled(request, besides=self._under_way)
                raise self._overtaken(request)
        name = operation or new_operation()
        writes = kind in (MarkerKind.SET, MarkerKind.CHANGE)
        said = {"simulated": True} if writes and self._simulated() else {}
        marker = Marker(name, kind, request, wall_label(), {**details, **said})
        if not self._recorded(lambda: self.outcomes.begin(marker)):
            self._unstored.add(name)
        self.ledger.begin(marker)
        self._decided(f"begun: {kind} {name}, {in_english(request)}", request)
        self._under_way[name] = kind
        if kind in _PROCEDURES:
            self._procedures[kind] = marker
        return marker

    def clear(self, marker: Marker, *entries: NewEntry) -> None:
        """Forget a marker whose outcome is known, and journal how it ended.

        Raises:
            LeaseLostError: Somebody else took over meanwhile, and what becomes of a procedure is
                for him to say.
            OutcomeUnknownError: The same of something that was sent: what it left may be changed.
        """
        self.ledger.ended(marker)
        self._under_way.pop(marker.operation, None)
        ends = ", ".join(str(entry.kind) for entry in entries) or "ended"
        self._decided(f"settled: {marker.kind} {marker.operation}, {ends}", marker.request)
        cleared = True
        if marker.kind in _PROCEDURES:
            self.outcomes.clear(marker.operation, *entries)
        else:
            try:
                cleared = self._recorded(lambda: self.outcomes.clear(marker.operation, *entries))
            except LeaseLostError as lost:
                raise OutcomeUnknownError(
                    lost.what,
                    remedy=lost.remedy,
                    controller=self._identity,
                    request=marker.request,
                ) from lost
        if cleared or marker.operation in self._unstored:
            self.ledger.recorded(marker)
        known = self._procedures.get(marker.kind)
        if known is not None and known.operation == marker.operation:
            del self._procedures[marker.kind]

    def leave_open(self, marker: Marker) -> None:
        """Count a marker as unsettled whose command has ended without a proof; no-op once cleared.

        Args:
            marker: It.
        """
        self._under_way.pop(marker.operation, None)

    @contextmanager
    def unless_stopped(self, marker: Marker) -> Iterator[None]:
        """Surround the sending of what ``marker`` stands for; a stop that forbids it settles it."""
        try:
            yield
        except StoppedError:
            self.clear(marker)  # it was never sent
            raise

    @property
    def changing(self) -> bool:
        """Whether a tool change of several steps is under way here."""
        marker = self._procedures.get(MarkerKind.CHANGE)
        # One that could not be taken back stays open when its change is over.
        return marker is not None and marker.details.get("change") == self.outcomes.change

    def note_selection(self, tool: int) -> None:
        """Record, in the marker of the procedure under way, which tool is in force now.

        Called when the controller has accepted the selection: until then the open marker of
        the selection itself says which other tool it may be.
        """
        marker = self._procedures.get(MarkerKind.SELECTION)
        if marker is not None and marker.details.get("now") != tool:
            noted = replace(marker, details={**marker.details, "now": tool})
            self._procedures[MarkerKind.SELECTION] = noted
            self._recorded(lambda: self.outcomes.begin(noted))

    def require_settled(self, request: str) -> None:
        """Refuse to go on while something earlier is unsettled.

        The markers of the procedures that run here do not count.

        Raises:
            OutcomeUnknownError: Names what is unsettled.
            LeaseHeldError: Somebody else is at it.
        """
        self._refuse_unsettled(request, besides=())

    def _refuse_while_moving(self, request: str) -> None:
        if self.moving:
            raise BusyError(
                tr(
                    "{request} has to wait: the end of a movement has not been seen.",
                    request=request,
                ),
                remedy=tr("Wait until the movement has ended, or stop it."),
            )

    def _refuse_unsettled(self, request: str, *, besides: Collection[str]) -> None:
        unsettled = self._unsettled(besides)
        if unsettled:
            # Whoever began it may still be at it, or have finished just now.
            self.outcomes.look()
            still = {marker.operation for marker in self._unsettled(besides)}
            unsettled = [marker for marker in unsettled if marker.operation in still]
        for marker in unsettled:
            raise OutcomeUnknownError(
                tr(
                    "Not done: {request}. An earlier job ({earlier}, {when}) did not finish.",
                    request=request,
                    earlier=marker.request,
                    when=local_label(marker.begun_at),
                ),
                remedy=tr("Next: 'robolink recover'. The robot stays blocked until then."),
            )

    def _overtaken(self, request: str) -> LeaseLostError:
        """Return the error where somebody else ended just now what was unsettled.

        What was read before that may be old, and the look at the lease that would tell has just
        been made anew.
        """
        return LeaseLostError(
            tr(
                "Not done: {request}. Another program changed this controller just now.",
                request=request,
            ),
            remedy=tr("Nothing was sent. Read the tools again, then start again."),
        )

    def _recorded(self, keep: Callable[[], object]) -> bool:
        """Keep something on record; return whether that was possible.

        Raises:
            JournalError: It was not, and nothing is being put back for which that is no matter.
        """
        try:
            keep()
        except JournalError:
            if not (self._latch.restores and self._procedures):
                raise
            return False
        return True

    def _unsettled(self, besides: Collection[str]) -> list[Marker]:
        own = {
            *besides,
            *(
                marker.operation
                for kind, marker in self._procedures.items()
                if kind is not MarkerKind.CHANGE or self.changing
            ),
        }
        return [m for m in self.outcomes.open_markers() if m.operation not in own]

    @contextmanager
    def doubt(self, request: str) -> Iterator[None]:
        """Turn a lost answer inside the block into OutcomeUnknownError."""
        try:
            yield
        except (TransportError, RemoteProtocolError) as error:
            raise self.unproved(request, error) from error

    def unproved(self, request: str, error: RobolinkError) -> OutcomeUnknownError:
        """Return the error for a request after which ``error`` tells nothing of what it did."""
        # The link is gone with the answer, and with it what was under way on it.
        self._under_way.clear()
        doubt = OutcomeUnknownError(
            tr(
                "No clear answer came to {request!r}: it may or may not have run ({cause})",
                request=request,
                cause=error.what,
            ),
            remedy=tr(
                "It was not sent again. Look at the robot. Next: 'robolink recover'. The "
                "robot stays blocked until then."
            ),
            controller=self._identity,
            request=request,
            raw=error.raw,
        )
        note_outcome(doubt, self.ledger.outcome())
        self._decided("no clear answer came; it was not sent again", request, doubtful=True)
        return doubt

    def _decided(self, text: str, request: str, *, doubtful: bool = False) -> None:
        tell = _LOG.doubted if doubtful else _LOG.decided
        tell(text, controller=self._identity, request=request)
