"""How an order ends that left no kept change, and what the next delivery is told.

A queue delivers again what was not acknowledged: because the answer was lost, and also because the
first delivery was refused. A person who said no, a stop, a limit and an open guard are decisions
about this order. Delivering it again must not overrule them, so they are on record, and the next
delivery ends in the same way. What only the moment was wrong for is tried again.
"""

from collections.abc import Mapping
from typing import Final

from robolink.errors import (
    BusyError,
    CalibrationError,
    ConfigError,
    ControllerError,
    DeclinedError,
    JournalError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    ProtocolError,
    RemoteProtocolError,
    ReservedToolError,
    RobolinkError,
    StoppedError,
    ToolError,
    ToolIndexError,
    TransportError,
    VerifyError,
)
from robolink.messages import first_sentence, tr
from robolink.plug_ins import unexpected
from robolink.timing import local_label

_KINDS: Final[tuple[type[RobolinkError], ...]] = (
    DeclinedError,
    StoppedError,
    VerifyError,
    CalibrationError,
    ToolIndexError,
    ReservedToolError,
    ToolError,
    ControllerError,
    ProtocolError,
    ConfigError,
)
"""Kinds of errors with which an order ends; anything else counts as the last one."""

_PASSES: Final = (NotReadyReason.RUNNING, NotReadyReason.STARTING)
"""States of a controller that end without a person."""


def only_the_moment(error: BaseException) -> bool:
    """Whether the same order may succeed later although nobody decides anything anew.

    Args:
        error: What ended a delivery.
    """
    if isinstance(error, NotReadyError):
        return error.reason in _PASSES
    return isinstance(error, (TransportError, BusyError, JournalError, OutcomeUnknownError))


def end_of(error: BaseException) -> dict[str, object]:
    """Return what goes on record of an order that ended for good, plain JSON.

    Args:
        error: What ended it.
    """
    kind = StoppedError if isinstance(error, KeyboardInterrupt) else type(error)
    if isinstance(error, RobolinkError):
        what = first_sentence(error.what)
    elif isinstance(error, KeyboardInterrupt):
        what = tr("It was interrupted.")
    else:
        what = unexpected(error)
    return {
        "as": next((one for one in _KINDS if issubclass(kind, one)), _KINDS[-1]).__name__,
        "code": getattr(error, "code", None) or None,
        "kind": type(error).__name__,
        "what": what,
    }


def as_before(order: str, at: str, ended: Mapping[str, object]) -> RobolinkError:
    """Return the error of a delivery whose order ended before.

    Args:
        order: Its id.
        at: When it ended, as a label.
        ended: How, as :func:`end_of` records it.
    """
    what = tr(
        "Order {order} ended on {at} without a kept change: {what}",
        order=order,
        at=local_label(at),
        what=ended.get("what", ""),
    )
    kind = next((one for one in _KINDS if one.__name__ == ended.get("as")), _KINDS[-1])
    code = str(ended.get("code") or "")
    if issubclass(kind, CalibrationError):
        return CalibrationError(code, what, remedy=anew())
    if issubclass(kind, VerifyError):
        return VerifyError(what, remedy=anew(), code=code)
    return (RemoteProtocolError if kind is ProtocolError else kind)(what, remedy=anew())


def anew() -> str:
    """Return what to do about an order that is not carried out again."""
    return tr("Nothing was moved or written. Give a new order if the work must be done again.")
