"""Commands that change something: marked before they leave, cleared when proved.

The command classes of design part 4 (faults_and_speed.md A3):

=====  ==========================================  =======================================
class  here                                        when no answer comes
=====  ==========================================  =======================================
READ   GetStatus, Print ..., TLSet, Where          ask again on a new link
SET    TLSet n, TLClr n, Tool n, SetIO ...         OutcomeUnknownError; read back, resolve
MOVE   Go, Move                                    OutcomeUnknownError; never sent again
STOP   Abort, Stop                                 may be repeated
=====  ==========================================  =======================================

Speed, SpeedS, Power and the motors need no marker: they are set and read back before each
move, and a lost answer leaves nothing that the next connection would not set again.
"""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from robolink.controllers.epson._session import EpsonSession
from robolink.errors import (
    BusyError,
    OutcomeUnknownError,
    RemoteProtocolError,
    TransportError,
)
from robolink.markers import new_operation, wall_label
from robolink.messages import tr
from robolink.model import Marker, MarkerKind, OutcomeLog


class ProcedureLock:
    """Lets one thread at a time run a procedure on a controller; others are told at once."""

    def __init__(self, identity: str) -> None:
        self._lock = threading.RLock()
        self._identity = identity

    @contextmanager
    def held(self, request: str) -> Iterator[None]:
        """Hold the procedure lock.

        Raises:
            BusyError: Another thread holds it.
        """
        if not self._lock.acquire(blocking=False):
            raise BusyError(
                tr("{request} has to wait: another operation is under way.", request=request),
                remedy=tr("Wait for it to end; stopping is possible at any time."),
                controller=self._identity,
                request=request,
            )
        try:
            yield
        finally:
            self._lock.release()


class MarkerDesk:
    """Writes and clears the durable markers of one controller."""

    def __init__(self, session: EpsonSession, outcomes: OutcomeLog) -> None:
        self._session = session
        self._outcomes = outcomes
        self._selection: Marker | None = None

    def begin(self, kind: MarkerKind, request: str, details: Mapping[str, object]) -> Marker:
        """Store a new marker durably; raises ConfigError when that is impossible."""
        marker = Marker(new_operation(), kind, request, wall_label(), dict(details))
        self._outcomes.begin(marker)
        if kind is MarkerKind.SELECTION:
            self._selection = marker
        return marker

    def note_selection(self, tool: int) -> None:
        """Record, in the marker of the procedure under way, which tool is in force now."""
        self._note({"now": tool})

    def note_written(self, tool: int, before: object, now: object) -> None:
        """Record, likewise, that ``tool`` was written, until it holds its first value again.

        Args:
            tool: Number of the tool.
            before: Plain value that it held.
            now: Plain value that it holds.
        """
        if self._selection is not None:
            known = self._selection.details.get("written")
            written = dict(known) if isinstance(known, dict) else {}
            first = written.setdefault(str(tool), before)
            if first == now:
                del written[str(tool)]
            self._note({"written": written})

    def _note(self, more: Mapping[str, object]) -> None:
        marker = self._selection
        if marker is not None:
            details = {**marker.details, **more}
            self._selection = Marker(
                marker.operation, marker.kind, marker.request, marker.begun_at, details
            )
            self._outcomes.begin(self._selection)

    def clear(self, marker: Marker) -> None:
        """Forget a marker whose outcome is proved."""
        self._outcomes.clear(marker.operation)
        if self._selection is not None and marker.operation == self._selection.operation:
            self._selection = None

    def require_settled(self, request: str) -> None:
        """Refuse to go on while something earlier is unsettled.

        The marker of the procedure that is running here does not count.

        Raises:
            OutcomeUnknownError: Names what is unsettled.
        """
        for marker in self._outcomes.open_markers():
            if self._selection is not None and marker.operation == self._selection.operation:
                continue
            raise OutcomeUnknownError(
                tr(
                    "{request!r} was not sent: {earlier!r} of {when} is not settled.",
                    request=request,
                    earlier=marker.request,
                    when=marker.begun_at,
                ),
                remedy=tr("Run 'robolink resolve' first; motion is blocked until then."),
                controller=self._session.identity,
                request=request,
            )

    @contextmanager
    def doubt(self, request: str) -> Iterator[None]:
        """Turn a lost answer inside the block into OutcomeUnknownError."""
        try:
            yield
        except (TransportError, RemoteProtocolError) as error:
            raise OutcomeUnknownError(
                tr(
                    "No answer came to {request!r}: it may or may not have run ({cause})",
                    request=request,
                    cause=error.what,
                ),
                remedy=tr(
                    "It was not sent again. Look at the robot, connect again and run "
                    "'robolink resolve'; motion is blocked until then."
                ),
                controller=self._session.identity,
                request=request,
                raw=error.raw,
            ) from error
