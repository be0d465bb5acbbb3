"""What becomes of a request on its way in: what of it arrives, when, how often; then it is done."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Final, Protocol

from robolink.protocols.epson_text import (
    NEED_DATA,
    BadRequest,
    EpsonTextCodec,
    Request,
    Role,
)
from robolink_simulators.epson.flash import Flash
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.remote.client_slot import ClientSlot
from robolink_simulators.epson.remote.exchange import PendingRequest
from robolink_simulators.epson.remote.link import EpsonServerLink
from robolink_simulators.epson.remote.service import Service
from robolink_simulators.faults import Fault, FaultAction, FaultPlan, LinkKind

AnyRequest = Request | BadRequest

_BENT: Final = (FaultAction.GARBLE_REQUEST, FaultAction.TRUNCATE_REQUEST)


class Mishaps(Protocol):
    """What happens to the controller at planned instants."""

    def strike(self, faults: Sequence[Fault], now_ns: int) -> None:
        """Do what is due now, and note what comes later."""

    def plan(self, now_ns: int, seconds: float, act: Callable[[], None]) -> None:
        """Have something done some time from now; at once when that is no time at all."""


class RequestIntake:
    """Lets requests in as a plan of faults has it, and has them carried out.

    Args:
        faults: The plan.
        mishaps: What happens to the controller meanwhile.
        service: Carries requests out.
        slot: Knows who is logged in.
        flash: Keeps what a request has changed.
        options: The controller's habits.
        told: Called with number and text of each request before it is carried out. What it
            raises goes to the host; the request is carried out all the same.
    """

    def __init__(
        self,
        faults: FaultPlan,
        mishaps: Mishaps,
        service: Service,
        slot: ClientSlot,
        flash: Flash,
        *,
        options: EpsonOptions,
        told: Callable[[int, str], None],
    ) -> None:
        self._faults = faults
        self._mishaps = mishaps
        self._service = service
        self._slot = slot
        self._flash = flash
        self._options = options
        self._told = told
        self._requests = 0

    def hears(self, link: EpsonServerLink) -> bool:
        """Tell whether a client is heard; while another is logged in, it is not."""
        if self._slot.client in (None, link):
            return True
        if self._options.second_client == "closed":
            link.cut()
        return False

    def take(self, link: EpsonServerLink, event: AnyRequest, shown: str, now_ns: int) -> None:
        """Deal with a request, as the plan has it."""
        faults = self._faults.take(shown, LinkKind.EPSON_SERIAL if link.serial else None)
        heard = self._arriving(link, event, faults)
        if heard is None:
            return
        self._mishaps.strike(faults, now_ns)
        if link.over:
            return  # a restart has cut it
        self.carry_out(link, heard, shown, now_ns, faults)
        for fault in faults:
            if fault.action is FaultAction.DUPLICATE_REQUEST:
                later_ns = now_ns + round(fault.seconds * 1e9)
                again = partial(self.carry_out, link, heard, shown, later_ns)
                self._mishaps.plan(now_ns, fault.seconds, again)

    def carry_out(
        self,
        link: EpsonServerLink,
        event: AnyRequest,
        shown: str,
        now_ns: int,
        faults: tuple[Fault, ...] = (),
    ) -> None:
        """Have a request carried out that has arrived."""
        self._requests += 1
        exchange = PendingRequest(self._requests, event.name, faults, link)
        try:
            self._told(exchange.number, shown)
        finally:
            self._service.carry_out(link, exchange, event, now_ns)
            self._flash.save_changes()

    def _arriving(
        self, link: EpsonServerLink, event: AnyRequest, faults: Sequence[Fault]
    ) -> AnyRequest | None:
        """Return what arrives of a request now, ``None`` for nothing."""
        heard: AnyRequest | None = event
        for fault in faults:
            if fault.action is FaultAction.DISCONNECT_BEFORE:
                link.cut()
                return None
            if fault.action is FaultAction.STALL:
                link.stall(event, fault.seconds)
                return None
            if fault.action is FaultAction.DROP_REQUEST:
                return None
            if heard is not None and fault.action in _BENT:
                heard = self._bent(heard, fault)
        return heard

    def _bent(self, event: AnyRequest, fault: Fault) -> AnyRequest | None:
        """Return what the controller makes of a request that was bent or cut short on its way.

        Raises:
            RemoteProtocolError: It makes nothing of it, and ends the connection.
        """
        sent, unterminated = _on_the_wire(event), self._options.requests_end_with_silence
        codec = EpsonTextCodec(Role.DEVICE, unterminated=unterminated)
        if fault.action is FaultAction.TRUNCATE_REQUEST:
            cut_at = len(sent) // 2 if fault.position is None else fault.position % len(sent)
            codec.receive_data(sent[:cut_at] or b" ")
            if unterminated:
                codec.end_of_request()
        else:
            codec.receive_data(self._faults.bent(sent, fault) + b"\r\n")
        heard = codec.next_event()
        return (
            heard if heard is not NEED_DATA and isinstance(heard, (Request, BadRequest)) else None
        )


def _on_the_wire(event: AnyRequest) -> bytes:
    """Return a request without its line end, as its client wrote it."""
    if isinstance(event, BadRequest):
        text = f"${event.name}"
    elif event.name.lower() == "execute":
        text = f'${event.name},"{event.parameters[0]}"'
    else:
        text = ",".join((f"${event.name}", *event.parameters))
    return text.encode("latin-1", "replace")
