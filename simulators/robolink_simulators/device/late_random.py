"""Chance by a seed that costs nothing until something is drawn: a generator takes 2.5 KB."""

import random
from collections.abc import Callable
from typing import Any, cast


class _LateRandom:
    """Stands for a generator that is made when it is first asked for something."""

    __slots__ = ("_first", "_generator", "_seed")

    def __init__(self, seed: str, first: Callable[[random.Random], object] | None) -> None:
        self._seed = seed
        self._first = first
        self._generator: random.Random | None = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever a generator has
        if name.startswith("__"):
            raise AttributeError(name)
        if self._generator is None:
            self._generator = random.Random(self._seed)
            if self._first is not None:
                self._first(self._generator)
        return getattr(self._generator, name)


def late_random(
    seed: str, *, first: Callable[[random.Random], object] | None = None
) -> random.Random:
    """Return what draws as ``random.Random(seed)`` does; thousands of cells draw nothing.

    Args:
        seed: Its seed.
        first: Draws what was drawn from it already.
    """
    return cast("random.Random", _LateRandom(seed, first))
