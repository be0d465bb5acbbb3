"""Durable markers of one controller: stored before a command is sent, cleared when confirmed.

What keeps two procedures of this process apart stands here too.
"""

import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from types import TracebackType
from typing import Final

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controller_outcome import note_outcome
from robolink.errors import (
    BusyError,
    Concerning,
    JournalError,
    LeaseHeldError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    StoppedError,
    TransportError,
)
from robolink.messages import in_english, listed, tr
from robolink.model import Ledger, Marker, MarkerKind, NewEntry, OutcomeLog, new_operation
from robolink.package_log import PackageLog
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.stop_latch import LOOK_S, Patience, StopLatch
from robolink.timing import local_label, wall_label

_LOG: Final = PackageLog(__package__)

# Every command asks for them, and before Python 3.12 a member of an Enum is found slowly.
_SET, _MOVE = MarkerKind.SET, MarkerKind.MOVE
_SELECTION, _CHANGE = MarkerKind.SELECTION, MarkerKind.CHANGE
_PROCEDURE: Final = Checkpoint.PROCEDURE

_PROCEDURES: Final = frozenset({_SELECTION, _CHANGE})
_OF_A_TOOL: Final = frozenset({"tool", "select"})
"""Details of markers for writing, clearing or selecting a tool."""


class ProcedureLock:
    """Lets one thread at a time run a procedure on a controller; others are refused, or wait.

    Those that wait get their turn in the order in which they came. Whoever may not wait is refused
    while others do.

    Attributes:
        patience: How long a call waits.

    Args:
        identity: Which controller.
        latch: Under which no procedure begins, and none ends well.
        outcomes: Keeps the lease, for which whoever may wait does that too.
    """

    def __init__(self, identity: str, latch: StopLatch, outcomes: OutcomeLog) -> None:
        self.patience = Patience(latch)
        self._identity = identity
        self._latch = latch
        self._outcomes = outcomes
        self._room = runtime.waiting_room()
        self._owner: int | None = None
        self._depth = 0
        self._waiting: list[int] = []

    @contextmanager
    def held(self, request: str, *, calming: bool = False, leased: bool = True) -> Iterator[None]:
        """Hold the procedure lock for one call.

        Args:
            request: What it is held for.
            calming: Whether that may go on while a stop is active, as a reset may.
            leased: Whether it needs the lease, as everything that is marked does.

        Raises:
            BusyError: Another thread holds it, or another program is at work, and for no longer is
                it waited.
            StoppedError: A stop is active, or came meanwhile.
        """
        with Concerning(self._identity, request), self.patience.within():
            if calming:
                with self._latch.calming(request), self._locked(request, calming=True):
                    yield
            else:
                with (
                    self._locked(request),
                    self._leased(request, wanted=leased),
                    self._latch.watching(request),
                ):
                    yield

    @contextmanager
    def procedure(self, request: str, *, wait_s: float | None = None) -> Iterator[bool]:
        """Hold it for a user's block; see :meth:`robolink.model.Controller.procedure`.

        Returns:
            Whether the lease is kept as well.
        """
        patience = self.patience
        with ExitStack() as block, patience.within(wait_s):
            with Concerning(self._identity, request):  # only for errors raised here
                block.enter_context(self._locked(request))
                leased = block.enter_context(self._leased(request))
            with patience.between():
                yield leased

    @contextmanager
    def _locked(self, request: str, *, calming: bool = False) -> Iterator[None]:
        checkpoint(_PROCEDURE, request)
        self._enter(request, calming=calming)
        try:
            yield
        finally:
            with self._room:
                self._depth -= 1
                if not self._depth:
                    self._owner = None
                    self._room.notify_all()

    def _enter(self, request: str, *, calming: bool) -> None:
        me = threading.get_ident()
        with self._room:
            if self._owner == me:
                self._depth += 1
                return
            if not self._is_free_for(me):
                self._await_turn(me, request, calming=calming)
            self._owner, self._depth = me, 1

    def _is_free_for(self, thread: int) -> bool:
        """Whether it is free and nobody else is next; who waits under a stop is leaving."""
        first = not self._waiting or self._waiting[0] == thread or self._latch.closed
        return self._owner is None and first

    def _await_turn(self, me: int, request: str, *, calming: bool) -> None:
        """Wait until it is this thread's turn.

        Raises:
            BusyError: That took too long.
            StoppedError: A stop came.
        """
        look: Callable[[], None] | None = None
        self._waiting.append(me)
        try:
            while not self._is_free_for(me):
                left_s = self.patience.left_s
                if not left_s:
                    raise BusyError(
                        tr(
                            "{request} must wait: another operation is running.",
                            request=request,
                        ),
                        remedy=tr(
                            "Wait for it to end ({wait}); stopping is possible at any time.",
                            wait=remedy_word(RemedyWord.WAIT),
                        ),
                    )
                look = look or self.patience.watch(request, calming=calming)
                look()
                self._room.wait(min(left_s, LOOK_S))
                look()
        finally:
            self._waiting.remove(me)
            self._room.notify_all()

    def _leased(
        self, request: str, *, wanted: bool = True
    ) -> AbstractContextManager[bool, bool | None]:
        """Wait for the lease if this call may wait, and keep it for the block.

        So nobody comes in between what is read and what is written. A record that cannot be kept
        is told by what needs it.
        """
        if wanted and self.patience.waits and self._depth == 1:
            return self._lease_kept(request)
        return nullcontext(False)

    @contextmanager
    def _lease_kept(self, request: str) -> Iterator[bool]:
        with ExitStack() as held:

            def take() -> None:
                self._outcomes.look()
                try:
                    held.enter_context(self._outcomes.hold(request))
                except LeaseLostError as lost:  # another process was faster; nothing is read yet
                    raise LeaseHeldError(lost.what, remedy=lost.remedy) from lost

            try:
                self.patience.until_free(take, request)
            except JournalError:
                yield False
                return
            yield True


class _Doubt:
    """See :meth:`MarkerStore.doubt`; each exchange of a movement is made in one."""

    __slots__ = ("_markers", "_request")

    def __init__(self, markers: "MarkerStore", request: str) -> None:
        self._markers = markers
        self._request = request

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if isinstance(error, (TransportError, RemoteProtocolError)):
            raise self._markers.unproved(self._request, error) from error


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
        """Note the state of the lease before reading a value that a write will rely on.

        Raises:
            LeaseHeldError: Somebody else is changing this controller.
        """
        self._recorded(self.outcomes.look)

    def beat(self) -> None:
        """Show others that this process is alive."""
        self.outcomes.beat()

    @property
    def moving(self) -> bool:
        """Whether a movement was started here whose end is not confirmed."""
        return _MOVE in self._under_way.values()

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store a marker durably: a new one, or an earlier one whose work continues.

        Whatever writes, moves or begins a procedure passes here, in a driver of anybody's. So this
        is where it is refused after a stop, while an earlier job is unfinished, and, of a tool,
        while the robot moves (docs/reference/rules.md 1, 2, 5). Only what puts back an earlier
        state goes on, and the work of an earlier marker.

        Args:
            kind: What it stands for.
            request: What is begun, as a person may read it.
            details: Plain JSON values needed to recover it.
            operation: Id of the earlier marker; empty for a new one.

        Raises:
            ConfigError: That is impossible.
            BusyError: Another process has the controller, or a movement is under way here.
            StoppedError: A stop is active.
            OutcomeUnknownError: An earlier job is unfinished; nothing may be sent.
            LeaseLostError: Somebody else was at it and has just ended.
        """
        if not operation and not self._latch.restores:
            self._latch.require_open(request)
            if kind is _SET and not _OF_A_TOOL.isdisjoint(details):
                self._refuse_while_moving(request)
            if self._unsettled(self._under_way):
                self._refuse_unsettled(request, besides=self._under_way)
                raise self._overtaken(request)
        name = operation or new_operation()
        writes = kind in (_SET, _CHANGE)
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
        """Remove a marker whose outcome is known, and record how it ended.

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
        """Count a marker as unfinished whose command ended unconfirmed; no-op once cleared.

        Args:
            marker: It.
        """
        self._under_way.pop(marker.operation, None)

    @contextmanager
    def unless_stopped(self, marker: Marker) -> Iterator[None]:
        """Surround the sending of a marked command; a stop that forbids it closes the marker."""
        try:
            yield
        except StoppedError:
            self.clear(marker)  # the request was never sent
            raise

    @property
    def changing(self) -> bool:
        """Whether a tool change of several steps is in progress here."""
        marker = self._procedures.get(_CHANGE)
        # A marker that could not be undone stays open after its change has ended.
        return marker is not None and marker.details.get("change") == self.outcomes.change

    def note_selection(self, tool: int) -> None:
        """Record, in the marker of the present procedure, which tool is selected now.

        Called when the controller has accepted the selection: until then the open marker of
        the selection itself says which other tool it may be.
        """
        marker = self._procedures.get(_SELECTION)
        if marker is not None and marker.details.get("now") != tool:
            noted = replace(marker, details={**marker.details, "now": tool})
            self._procedures[_SELECTION] = noted
            self._recorded(lambda: self.outcomes.begin(noted))

    def require_settled(self, request: str) -> None:
        """Refuse to go on while an earlier job is unfinished.

        The markers of the procedures that run here do not count.

        Raises:
            OutcomeUnknownError: Names the unfinished jobs.
            LeaseHeldError: Somebody else has it locked.
        """
        self._refuse_unsettled(request, besides=())

    def _refuse_while_moving(self, request: str) -> None:
        if self.moving:
            raise BusyError(
                tr(
                    "{request} must wait: robolink has not seen the end of a movement.",
                    request=request,
                ),
                remedy=tr("Wait until the movement has ended, or stop it."),
            )

    def _refuse_unsettled(self, request: str, *, besides: Collection[str]) -> None:
        unsettled = self._unsettled(besides)
        if unsettled:
            # Its owner may still be working on it, or may have just finished.
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
        """Return the error if somebody else has just finished the unfinished job.

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
        """Record something; return whether that was possible.

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
                if kind is not _CHANGE or self.changing
            ),
        }
        return [m for m in self.outcomes.open_markers() if m.operation not in own]

    def doubt(self, request: str) -> AbstractContextManager[None]:
        """Turn a lost answer inside the block into OutcomeUnknownError."""
        return _Doubt(self, request)

    def unproved(self, request: str, error: RobolinkError) -> OutcomeUnknownError:
        """Return the error for a request whose effect ``error`` leaves unknown."""
        # The link is lost with the answer, and so is everything under way on it.
        self._under_way.clear()
        doubt = OutcomeUnknownError(
            listed(
                tr(
                    "No clear answer came to {request!r}: it may or may not have run.",
                    request=request,
                ),
                [error.what],
            ),
            remedy=tr(
                "Not sent again; the robot stays blocked. Look at it. Next: 'robolink recover'."
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
