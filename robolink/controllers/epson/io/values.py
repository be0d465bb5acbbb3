"""Values that a request of their own sets: outputs, memory bits, variables.

Class SET of docs/reference/rules.md 1: nothing is sent when the value is there already; a durable
marker stands before the request leaves; the request is sent once; the value is read back. Ctrl-C
waits for the end of that.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic

from robolink.controllers.driver_link import MarkedCommand
from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.link.requests import as_sent
from robolink.controllers.epson.link.session import EpsonSession
from robolink.errors import ReadBackError, RejectedError
from robolink.messages import tr
from robolink.model import Marker, NewEntry, ValueReceipt, ValueT
from robolink.protocols.epson_text import Request


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

    def __init__(self, link: EpsonLink) -> None:
        self._link = link

    def preview(self, change: Change[ValueT]) -> tuple[str, ...]:
        """Return the requests that :meth:`carry_out` would send besides its reads."""
        request = as_sent(change.request)
        self._link.window.require_ready(request)
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
        with self._link.lock.held(request):
            self._link.window.require_ready(request)
            before = change.read()
            if change.same(before, change.requested):
                return ValueReceipt(request, before, change.requested, before, skipped=True)
            found = self._link.carry_out(_Setting(change, request, before, self._link.session))
        if not change.same(found, change.requested):
            raise ReadBackError(
                tr(
                    "{request} was accepted, but reads back as {found!r} instead of {requested!r}.",
                    request=request,
                    found=found,
                    requested=change.requested,
                ),
                remedy=tr("A program or the PLC may set it too. Nothing was repeated."),
                controller=self._link.identity,
                request=request,
            )
        return ValueReceipt(request, before, change.requested, found, skipped=False)


class _Setting(MarkedCommand[ValueT]):
    """The sending of one value."""

    def __init__(
        self, change: Change[ValueT], request: str, before: ValueT, session: EpsonSession
    ) -> None:
        super().__init__(request)
        self._change = change
        self._before = before
        self._session = session

    @property
    def details(self) -> Mapping[str, object]:
        change = self._change
        item = list(change.item)
        return {"item": item, "before": self._before, "requested": change.requested}

    def send(self) -> None:
        self._session.exchange(self._change.request.name, *self._change.request.parameters)

    def read(self) -> ValueT:
        return self._change.read()

    def refusal(self, marker: Marker, error: RejectedError) -> Iterable[NewEntry]:  # noqa: ARG002 - none is kept
        return ()
