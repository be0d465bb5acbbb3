"""What of a request arrives that was lost, delayed, bent or cut short on its way."""

from collections.abc import Sequence
from typing import Protocol

from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec
from robolink.protocols.epson_text import BadRequest, EpsonTextCodec, Request
from robolink_simulators.faults import Fault, FaultAction, FaultPlan


class Carrier(Protocol):
    """The link that a request came over."""

    @property
    def dialect(self) -> Dialect | None:
        """How its frames are written; ``None`` for Remote Ethernet."""

    def cut(self) -> None:
        """End it."""

    def stall(self, event: Request | BadRequest, seconds: float) -> None:
        """Let nothing pass for a while, and the request after that."""


def arriving(
    link: Carrier,
    event: Request | BadRequest,
    faults: Sequence[Fault],
    plan: FaultPlan,
    *,
    unterminated: bool,
) -> Request | BadRequest | None:
    """Return the request that the controller hears now.

    Args:
        link: Where it came over.
        event: The request that was sent.
        faults: Those that it meets.
        plan: Draws what a fault leaves open.
        unterminated: Whether a request may lack its line end.

    Returns:
        ``None`` when nothing of use arrives.

    Raises:
        RemoteProtocolError: What arrives makes no sense.
    """
    heard: Request | BadRequest | None = event
    for fault in faults:
        match fault.action:
            case FaultAction.DISCONNECT_BEFORE:
                link.cut()
                return None
            case FaultAction.DROP_REQUEST:
                return None
            case FaultAction.STALL:
                link.stall(event, fault.seconds)
                return None
            case FaultAction.GARBLE_REQUEST | FaultAction.TRUNCATE_REQUEST if heard:
                if link.dialect is None:
                    heard = _bent_text(heard, fault, plan, unterminated=unterminated)
                else:
                    heard = _bent_frame(heard, fault, plan, link.dialect)
    return heard


def _bent_text(
    event: Request | BadRequest, fault: Fault, plan: FaultPlan, *, unterminated: bool
) -> Request | BadRequest | None:
    sent = _on_the_wire(event)
    codec = EpsonTextCodec(Role.DEVICE, unterminated=unterminated)
    if fault.action is FaultAction.TRUNCATE_REQUEST:
        codec.receive_data(sent[: _cut_at(fault, sent)] or b" ")
        if unterminated:
            codec.end_of_request()
    else:
        codec.receive_data(plan.bent(sent, fault) + b"\r\n")
    return _heard(codec.next_event())


def _bent_frame(
    event: Request | BadRequest, fault: Fault, plan: FaultPlan, dialect: Dialect
) -> Request | BadRequest | None:
    """Behind a frame that is cut short the line is silent, and so ends it."""
    if isinstance(event, BadRequest):
        return event
    sent = EpsonBinaryCodec(Role.HOST, dialect).send(event)
    cut = fault.action is FaultAction.TRUNCATE_REQUEST
    codec = EpsonBinaryCodec(Role.DEVICE, dialect)
    codec.receive_data(sent[: _cut_at(fault, sent)] or b" " if cut else plan.bent(sent, fault))
    return _heard(codec.next_event()) or _heard(codec.end_of_request())


def _cut_at(fault: Fault, sent: bytes) -> int:
    return len(sent) // 2 if fault.position is None else fault.position % len(sent)


def _heard(event: object) -> Request | BadRequest | None:
    return event if event is not NEED_DATA and isinstance(event, (Request, BadRequest)) else None


def _on_the_wire(event: Request | BadRequest) -> bytes:
    """Return a request without its line end, as its client wrote it."""
    if isinstance(event, BadRequest):
        return f"${event.name}".encode("latin-1", "replace")
    if event.name.lower() == "execute":
        return f'${event.name},"{event.parameters[0]}"'.encode("latin-1", "replace")
    return ",".join((f"${event.name}", *event.parameters)).encode("latin-1", "replace")
