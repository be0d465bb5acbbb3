"""Numbers by which simulated controllers are told apart.

Each simulator is a controller of its own: what was left unfinished on one is not for the next
one on its port.
"""

import random
from typing import Final

from robolink import ambient

_HIGHEST: Final = 0xFFFF_FFFF


def drawn_number(origin: str = "") -> int:
    """Return a number from 1 to 2^32 - 1.

    Args:
        origin: The same text draws the same number; empty draws another one each time.
    """
    if origin:
        return random.Random(f"serial {origin}").randint(1, _HIGHEST)
    return ambient.random_number(32)


def drawn_serial(origin: str = "") -> str:
    """Return a serial number as :func:`drawn_number` draws it, marked as a simulator's."""
    return f"SIM{drawn_number(origin):08X}"
