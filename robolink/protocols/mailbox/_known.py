"""Numbers from a PLC that may be newer than this program."""

from enum import IntEnum
from functools import lru_cache


@lru_cache(maxsize=1024)
def known(codes: type[IntEnum], number: int) -> int:
    """Return the member of ``codes`` with this number, or the plain number without one."""
    try:
        return codes(number)
    except ValueError:
        return number
