"""What of a request arrives that was bent or cut short on its way."""

from robolink.protocols.epson_text import (
    NEED_DATA,
    BadRequest,
    EpsonTextCodec,
    Request,
    Role,
)
from robolink_simulators.faults import Fault, FaultAction, FaultPlan


def arriving(
    event: Request | BadRequest, fault: Fault, plan: FaultPlan, *, unterminated: bool
) -> Request | BadRequest | None:
    """Return the request that the controller hears.

    Args:
        event: The request that was sent.
        fault: GARBLE_REQUEST or TRUNCATE_REQUEST.
        plan: Draws what the fault leaves open.
        unterminated: Whether a request may lack its line end.

    Returns:
        ``None`` when nothing of use arrives.

    Raises:
        RemoteProtocolError: What arrives makes no sense.
    """
    sent = _on_the_wire(event)
    codec = EpsonTextCodec(Role.DEVICE, unterminated=unterminated)
    if fault.action is FaultAction.TRUNCATE_REQUEST:
        cut_at = len(sent) // 2 if fault.position is None else fault.position % len(sent)
        codec.receive_data(sent[:cut_at] or b" ")
        if unterminated:
            codec.end_of_request()
    else:
        codec.receive_data(plan.bent(sent, fault) + b"\r\n")
    heard = codec.next_event()
    return heard if heard is not NEED_DATA and isinstance(heard, (Request, BadRequest)) else None


def _on_the_wire(event: Request | BadRequest) -> bytes:
    """Return a request without its line end, as its client wrote it."""
    if isinstance(event, BadRequest):
        return f"${event.name}".encode("latin-1", "replace")
    if event.name.lower() == "execute":
        return f'${event.name},"{event.parameters[0]}"'.encode("latin-1", "replace")
    return ",".join((f"${event.name}", *event.parameters)).encode("latin-1", "replace")
