"""Checks of what a command carries."""

import math
from collections.abc import Container, Sequence

from robolink.protocols.mailbox import SLOTS, ErrorClass
from robolink_simulators.softmotion.mailbox.commands.complaints import Rejected


def require_operand(value: int, allowed: Container[int]) -> int:
    """Return an operand, which must be one of ``allowed``.

    Raises:
        Rejected: OPERAND.
    """
    if value not in allowed:
        raise Rejected(ErrorClass.OPERAND)
    return value


def require_finite(values: Sequence[float]) -> None:
    """Refuse numbers that are not finite.

    Raises:
        Rejected: OPERAND.
    """
    if not all(map(math.isfinite, values)):
        raise Rejected(ErrorClass.OPERAND)


def require_slot(number: int) -> int:
    """Return the number of a slot, which there must be.

    Raises:
        Rejected: SLOT_OUT_OF_RANGE.
    """
    if number not in SLOTS:
        raise Rejected(ErrorClass.SLOT_OUT_OF_RANGE)
    return number
