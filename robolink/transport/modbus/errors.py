"""Sentences for what goes wrong between this computer and a Modbus server.

Addresses are always given both ways, as the number that manuals print and as the one on the
wire, because tools disagree about which one they mean. Exception codes:
Modbus application protocol 1.1b3, chapter 7.
"""

from typing import Final

from robolink.errors import (
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.transport.modbus.frames import ModbusRequest

_SHOWN_BYTES: Final = 256
_GATEWAY_NO_PATH: Final = 0x0A
_GATEWAY_NO_ANSWER: Final = 0x0B
_NOT_DONE: Final = frozenset({1, 2, 3, 6})
"""Exception codes after which a write was certainly not carried out."""


def describe(request: ModbusRequest) -> str:
    """Return a request for display."""
    where = tr(
        "{reference} (address {address}) of unit {unit}",
        reference=request.area.reference(request.address),
        address=request.address,
        unit=request.unit,
    )
    if request.values:
        return tr("write {count} from {where}", count=request.count, where=where)
    return tr("read {count} from {where}", count=request.count, where=where)


def unanswered(
    identity: str, request: ModbusRequest, held: bytes, *, serial: bool
) -> TransportTimeoutError:
    """Return the error for an answer that did not come, or not whole."""
    if serial and (noise := _noise(held)):
        return TransportTimeoutError(
            tr(
                "{identity} sent only {count} bytes of its answer.",
                identity=identity,
                count=len(held),
            ),
            remedy=noise,
            request=describe(request),
            raw=held,
        )
    if held:
        what = tr(
            "{identity} sent only {count} bytes of its answer: {request}.",
            identity=identity,
            count=len(held),
            request=describe(request),
        )
    else:
        what = tr(
            "{identity} did not answer: {request}.", identity=identity, request=describe(request)
        )
    remedy = tr(
        "Check cable and power of the PLC and the unit ({unit}), then try again.", unit=request.unit
    )
    if serial:
        remedy = tr(
            "Check the PLC's cable and power, baud rate and unit ({unit}), then try again.",
            unit=request.unit,
        )
    return TransportTimeoutError(
        what,
        remedy=remedy,
        request=describe(request),
        raw=held,
    )


def flooding(identity: str, request: ModbusRequest, count: int, raw: bytes) -> RemoteProtocolError:
    """Return the error for a far end that keeps sending unrequested data."""
    return RemoteProtocolError(
        tr(
            "{identity} sent {count} bytes without an end, and no answer to {request}.",
            identity=identity,
            count=count,
            request=describe(request),
        ),
        remedy=tr("Check that this is its Modbus port; on a serial line, find a second client."),
        request=describe(request),
        raw=raw[-_SHOWN_BYTES:],
    )


def restless(identity: str, count: int, raw: bytes) -> RemoteProtocolError:
    """Return the error for a serial line without a pause."""
    return RemoteProtocolError(
        tr(
            "The line of {identity} is never quiet: {count} bytes without a pause.",
            identity=identity,
            count=count,
        ),
        remedy=tr("Look for a second client on it, or a device that never stops."),
        raw=raw[-_SHOWN_BYTES:],
    )


def hung_up(identity: str) -> TransportBrokenError:
    """Return the error for a server that ended the connection."""
    return TransportBrokenError(
        tr("{identity} closed the connection.", identity=identity),
        remedy=tr(
            "Its number of clients may be limited, or its watchdog has run out: close other "
            "clients, then connect again."
        ),
    )


def _noise(raw: bytes) -> str:
    """Return what to do about a 00 before an answer; empty where there is none."""
    if raw[:1] != b"\0":
        return ""
    return tr(
        "The 00 in front is noise of an idle RS-485 line: fit bias resistors and "
        "terminators, or let the adapter switch later. Else check baud rate and parity."
    )


def unintelligible(
    identity: str, request: ModbusRequest, raw: bytes, *, serial: bool
) -> RemoteProtocolError:
    """Return the error for bytes that are not Modbus."""
    remedy = tr("Check that this is the PLC's Modbus port.")
    if serial:
        remedy = _noise(raw) or tr("Check the baud rate, the parity and the cable.")
    return RemoteProtocolError(
        tr("What {identity} sent is not Modbus.", identity=identity),
        remedy=remedy,
        request=describe(request),
        raw=raw,
    )


def mismatched(identity: str, request: ModbusRequest) -> RemoteProtocolError:
    """Return the error for an answer to another request than the one it claims."""
    return RemoteProtocolError(
        tr("{identity} answered something other than asked.", identity=identity),
        remedy=tr(
            "Check the unit in the URL ({unit}), and for a second device at this address.",
            unit=request.unit,
        ),
        request=describe(request),
    )


def echoing(identity: str, request: ModbusRequest, raw: bytes) -> RemoteProtocolError:
    """Return the error for a line that returns what is sent, unexpectedly."""
    return RemoteProtocolError(
        tr("{identity} returns what is sent to it.", identity=identity),
        remedy=tr("An RS-485 adapter that hears itself needs echo=yes in the URL."),
        request=describe(request),
        raw=raw,
    )


def echo_missing(identity: str, request: ModbusRequest, raw: bytes) -> RemoteProtocolError:
    """Return the error for a line that should return what is sent, and does not."""
    return RemoteProtocolError(
        tr("{identity} did not return what was sent.", identity=identity),
        remedy=tr(
            "Either the adapter does not hear itself: remove echo=yes. Or two devices spoke at "
            "once: look for a second client on the line."
        ),
        request=describe(request),
        raw=raw,
    )


def refused(identity: str, request: ModbusRequest, code: int) -> RobolinkError:
    """Return the error for a Modbus exception.

    A refusal that leaves open whether a write was done is no ``RejectedError``.
    """
    name, remedy = _told(code, request.unit)
    what = tr(
        "{identity} refused with Modbus exception {code} ({name}): {request}.",
        identity=identity,
        code=code,
        name=name,
        request=describe(request),
    )
    shown = describe(request)
    if code == _GATEWAY_NO_PATH:
        return ConnectError(what, remedy=remedy, request=shown)
    if code == _GATEWAY_NO_ANSWER:
        return TransportTimeoutError(what, remedy=remedy, request=shown)
    if request.values and code not in _NOT_DONE:
        return RemoteProtocolError(what, remedy=remedy, request=shown)
    return RejectedError(what, code=code, remedy=remedy, request=shown)


def _told(code: int, unit: int) -> tuple[str, str]:
    """Return the name of an exception code, and what to do."""
    match code:
        case 1:
            told = (
                tr("illegal function"),
                tr("Check that the PLC's Modbus device offers this kind of register."),
            )
        case 2:
            told = (
                tr("illegal data address"),
                tr("Check the URL's addresses (40001 is 0) and the PLC's Modbus area sizes."),
            )
        case 3:
            told = (
                tr("illegal data value"),
                tr("Raise the PLC's register limit, or state it in the URL (most_registers=50)."),
            )
        case 4:
            told = tr("server device failure"), _unclear()
        case 5:
            told = tr("acknowledged, not finished"), _unclear()
        case 6:
            told = (
                tr("server busy"),
                tr("Wait until the PLC has finished what it does, then try again."),
            )
        case 7:
            told = tr("negative acknowledge"), _unclear()
        case 8:
            told = tr("memory parity error"), _unclear()
        case 0x0A:
            told = (
                tr("gateway path unavailable"),
                tr(
                    "The gateway knows no unit {unit}: give another one with unit= in the URL.",
                    unit=unit,
                ),
            )
        case 0x0B:
            told = (
                tr("gateway target is silent"),
                tr(
                    "Check unit= in the URL ({unit}), and power and cable of that device.",
                    unit=unit,
                ),
            )
        case _:
            told = tr("not in the standard"), _unclear()
    return told


def _unclear() -> str:
    return tr("Look at the PLC; read its state before anything else.")
