"""Values that a request of their own sets: outputs, memory bits, variables.

Class SET of docs/reference/rules.md 1: nothing is sent when the value is there already; a durable
marker stands before the request leaves; the request is sent once; the value is read back. Ctrl-C
waits for the end of that.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from robolink.controllers.epson.link.answers import NOT_EXECUTED
from robolink.controllers.epson.link.requests import as_sent
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.errors import ReadBackError, RejectedError
from robolink.messages import tr
from robolink.model import MarkerKind
from robolink.protocols.epson_text import Request

Value = bool | int | float | str
ValueT = TypeVar("ValueT", bound=Value)


@dataclass(frozen=True, slots=True)
class ValueReceipt(Generic[ValueT]):
    """What setting a value did.

    Attributes:
        request: The request, as it stands on the wire.
        before: What was there.
        requested: What was asked for.
        read_back: What is there now.
        skipped: It was there already, so nothing was sent.
    """

    request: str
    before: ValueT
    requested: ValueT
    read_back: ValueT
    skipped: bool


@dataclass(frozen=True, slots=True)
class Change(Generic[ValueT]):
    """One value to set.

    Attributes:
        request: What sets it.
        item: What it is, in plain values, for whoever settles a doubt later.
        requested: The new value.
        read: Reads the value that is there.
        same: Tells whether two values are equal for this controller.
    """

    request: Request
    item: tuple[str, ...]
    requested: ValueT
    read: Callable[[], ValueT]
    same: Callable[[ValueT, ValueT], bool]


class ValueSetter:
    """Carries out a :class:`Change`."""

    def __init__(
        self,
        session: EpsonSession,
        window: CommandWindow,
        markers: MarkerStore,
        lock: ProcedureLock,
    ) -> None:
        self._session = session
        self._window = window
        self._markers = markers
        self._lock = lock

    def preview(self, change: Change[ValueT]) -> tuple[str, ...]:
        """Return the requests that :meth:`carry_out` would send besides its reads."""
        request = as_sent(change.request)
        self._window.require_ready(request)
        return () if change.same(change.read(), change.requested) else (request,)

    def carry_out(self, change: Change[ValueT]) -> ValueReceipt[ValueT]:
        """Set the value and prove it.

        Raises:
            NotReadyError: The state forbids it, monitoring only included.
            RejectedError: The controller refused; nothing was set.
            ReadBackError: Another value is there afterwards.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """
        request = as_sent(change.request)
        with self._lock.held(request):
            self._window.require_ready(request)
            before = change.read()
            if change.same(before, change.requested):
                return ValueReceipt(request, before, change.requested, before, skipped=True)
            found = self._set(change, request, before)
        if not change.same(found, change.requested):
            raise ReadBackError(
                tr(
                    "{request} was accepted, but {found!r} is read back in place of {requested!r}.",
                    request=request,
                    found=found,
                    requested=change.requested,
                ),
                remedy=tr("A program or the PLC may set it too. Nothing was repeated."),
                controller=self._session.identity,
                request=request,
            )
        return ValueReceipt(request, before, change.requested, found, skipped=False)

    def _set(self, change: Change[ValueT], request: str, before: ValueT) -> ValueT:
        details = {"item": list(change.item), "before": before, "requested": change.requested}
        with self._session.uninterrupted(), self._markers.ledger.block():
            marker = self._markers.begin(MarkerKind.SET, request, details)
            with self._markers.doubt(request):
                try:
                    with self._markers.unless_stopped(marker):
                        self._session.exchange(change.request.name, *change.request.parameters)
                except RejectedError as error:
                    if error.code in NOT_EXECUTED:
                        self._markers.clear(marker)
                    raise
                found = change.read()
            self._markers.ledger.proved(marker, found)
            self._markers.clear(marker)
        return found
