"""Whether this machine is quiet enough for figures: the same small work, again and again."""

import math
import os
import socket
from dataclasses import dataclass, field
from statistics import fmean
from time import perf_counter
from typing import Final

SPREAD: Final = 2.0
"""Largest spread at which figures are published."""

_LOOKS: Final = 150
_EXCHANGES: Final = 100
_SUMS: Final = 2_000


@dataclass(slots=True)
class Floors:
    """How long the same work took around each case.

    Attributes:
        taken_us: Its mean at each look: other work that takes the processor away shows in it.
        best_us: The fastest that it ever was.
    """

    taken_us: list[float] = field(default_factory=list)
    best_us: float = math.inf

    def look(self) -> None:
        """Measure once more."""
        mean_us, best_us = floor_us()
        self.taken_us.append(mean_us)
        self.best_us = min(self.best_us, best_us)

    @property
    def spread(self) -> float:
        """Slowest look over the fastest work; little above 1 where nothing else is done."""
        return max(self.taken_us) / self.best_us

    @property
    def quiet(self) -> bool:
        """Whether figures may be published."""
        return self.spread <= SPREAD

    def __str__(self) -> str:
        low, high = min(self.taken_us), max(self.taken_us)
        told = f"the same work took {low:.0f} to {high:.0f} us"
        return f"{told}, {self.spread:.2f} times its fastest"


def floor_us() -> tuple[float, float]:
    """Return mean and least microseconds of a hundred bare exchanges and a fixed sum."""
    one, other = socket.socketpair()
    with one, other:
        taken = [_once(one, other) * 1e6 for _ in range(_LOOKS)]
    return fmean(taken), min(taken)


def _once(one: socket.socket, other: socket.socket) -> float:
    began = perf_counter()
    for _ in range(_EXCHANGES):
        one.send(b"$GetStatus\r\n")
        other.send(other.recv(64))
        one.recv(64)
    sum(number * number for number in range(_SUMS))
    return perf_counter() - began


def load_average() -> str:
    """Return how busy the machine has been for a minute."""
    try:
        return f"{os.getloadavg()[0]:.2f}"
    except (AttributeError, OSError):
        return "unknown"
