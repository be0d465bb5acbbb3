"""What a controller does with a request: faults, log and hooks around what it is served with."""

from abc import ABC
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

from robolink.protocols.epson_text import BadRequest, Request
from robolink_simulators.device.hosted import HostedDevice
from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.flash import Flash
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.remote.bent_requests import arriving
from robolink_simulators.epson.remote.client_slot import ClientSlot
from robolink_simulators.epson.remote.command_window import SpelWindow
from robolink_simulators.epson.remote.exchange import PendingRequest
from robolink_simulators.epson.remote.link import EpsonServerLink
from robolink_simulators.epson.remote.service import Service
from robolink_simulators.epson.remote.wire_text import shown_reply, shown_request
from robolink_simulators.faults import Departure, Fault, FaultAction, FaultPlan, LinkKind


class PlannedMishaps(Protocol):
    """What goes wrong around the controller, at once or later."""

    def strike(self, faults: Sequence[Fault], now_ns: int) -> None:
        """Do what is due now, and note what comes later."""

    def plan(self, now_ns: int, seconds: float, act: Callable[[], None]) -> None:
        """Have something done some time from now."""


class RequestTaking(HostedDevice, ABC):
    """Implements :class:`~robolink_simulators.epson.remote.link.ServedRequest`.

    Attributes:
        options: The controller's habits.
        condition: What GetStatus shows.
        faults: What is planned to go wrong.
    """

    options: EpsonOptions
    condition: Condition
    faults: FaultPlan
    _slot: ClientSlot
    _service: Service
    _window: SpelWindow
    _mishaps: PlannedMishaps
    _flash: Flash
    _settled_ns: int
    """Until when all is done, -1 after anything that may have changed what comes."""

    def take(self, link: EpsonServerLink, event: Request | BadRequest) -> None:
        """Deal with a request of a client; while another is logged in, it is not heard."""
        self._settled_ns, shown = -1, shown_request(event)
        self.log.add(self.now_ns, ">", shown)
        if not self._slot.hears(link, cuts=self.options.second_client == "closed"):
            return
        faults = self.faults.take(shown, LinkKind.EPSON_SERIAL if link.dialect else None)
        if faults:
            self._take_disturbed(link, event, shown, faults)
        else:
            self._carry_out(link, event, shown, ())

    def _take_disturbed(
        self,
        link: EpsonServerLink,
        event: Request | BadRequest,
        shown: str,
        faults: tuple[Fault, ...],
    ) -> None:
        silence = self.options.requests_end_with_silence
        heard = arriving(link, event, faults, self.faults, unterminated=silence)
        if heard is None:
            return
        self._mishaps.strike(faults, self.now_ns)
        if link.over:  # a restart has cut it
            return
        self._carry_out(link, heard, shown, faults)
        for fault in faults:
            if fault.action is FaultAction.DUPLICATE_REQUEST:
                again = partial(self._carry_out, link, heard, shown, ())
                self._mishaps.plan(self.now_ns, fault.seconds, again)

    def take_late(self, link: EpsonServerLink, event: Request | BadRequest) -> None:
        """Deal with a request that was under way while its link carried nothing."""
        if self._slot.hears(link, cuts=self.options.second_client == "closed"):
            self._carry_out(link, event, shown_request(event), ())

    def _carry_out(
        self,
        link: EpsonServerLink,
        event: Request | BadRequest,
        shown: str,
        faults: tuple[Fault, ...],
    ) -> None:
        self._requests += 1
        exchange = PendingRequest(self._requests, event.name, faults, link)
        try:
            if self.on_request is not None:
                self.on_request(exchange.number, shown)
        finally:
            self._service.carry_out(link, exchange, event, self.now_ns)
            self._flash.save_changes()

    def leaving(self, exchange: PendingRequest, reply: bytes) -> Sequence[Departure]:
        """Count a reply and return what of it leaves, when."""
        self._flash.save_changes()
        self.exchanges += 1
        # A login that was bent may come back in its refusal.
        echoed = bool(exchange.faults) and reply[:1] == b"!"
        self.log.add(self.now_ns, "<", "***" if echoed else shown_reply(reply))
        if not exchange.faults:
            self.faults.remember(reply)
            return ((0.0, reply),)
        return self.faults.departures(reply, exchange.faults)

    def listening(self) -> None:
        """Look anew for what happens next: a request has begun that silence may end."""
        self._settled_ns = -1

    def announce(self, exchange: PendingRequest, reply: bytes) -> None:
        """Tell the hook that a reply is about to leave."""
        if self.on_reply is not None:
            self.on_reply(exchange.number, shown_reply(reply))

    def forget(self, link: EpsonServerLink) -> None:
        """A connection is over; what runs goes on or not, as the option says."""
        self._settled_ns = -1
        if self._slot.client is link:
            # Production that another device started is not this client's to supervise.
            own = self._service.unfinished and not self.condition.monitoring_only
            self._slot.lost(unfinished=own)
            if self.options.execute_on_disconnect == "stops":
                self._window.interrupt(self.now_ns)
