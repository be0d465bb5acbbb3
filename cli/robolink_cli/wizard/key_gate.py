"""Which keys count: pressed by a hand, alone, and not held from before.

A scanner sends a bar code as keys within milliseconds and ends it with CR LF; a paste is faster
still. Two keys of a person are further apart. So a key is held back for a moment, and when another
one follows, neither counts (docs/decisions/0041). A key that is held down repeats by itself, always
the same one, never faster than a terminal repeats: those count one by one.
"""

from dataclasses import dataclass
from typing import Final

from robolink_cli.wizard.keys import KEYPAD

ALONE_S: Final = 0.035
"""A key counts when none other follows within this."""

REPEATS_S: Final = 0.012
"""A held key repeats slower than this; a scanner sends one digit twice faster."""

AT_ONCE: Final = frozenset({"escape", "c-c"})
"""What stops, and never waits for anything."""

_NAMES: Final = {
    " ": "main",
    "space": "main",
    "escape": "stop",
    "c-c": "stop",
    "c-m": "enter",
    "c-j": "enter",
    "c-h": "backspace",
    **KEYPAD,
}


def name_of(key: str) -> str:
    """Return the name by which the flow knows a key of a terminal."""
    return _NAMES.get(key, key)


@dataclass(slots=True)
class _Held:
    key: str
    since_s: float


class KeyGate:
    """Lets single keys through, and drops bursts. Times are those of one monotonic clock."""

    def __init__(self) -> None:
        self._held: _Held | None = None
        self._last: tuple[str, float] | None = None
        self._burst_s: float | None = None

    def press(self, key: str, at_s: float, *, stops: bool = False) -> list[str]:
        """Take a key; return those that count by now, in their order.

        Args:
            key: The key.
            at_s: When it came.
            stops: Whether it stops where the person is now, and so never waits either.
        """
        if stops or key in AT_ONCE:
            self._held, self._burst_s = None, None
            self._last = (key, at_s)
            return [key]
        last, self._last = self._last, (key, at_s)
        if self._burst_s is not None:
            if at_s - self._burst_s < ALONE_S:
                self._burst_s = at_s
                return []
            self._burst_s = None
        after_s = at_s - last[1] if last else ALONE_S
        if last and after_s < ALONE_S and not (key == last[0] and after_s >= REPEATS_S):
            self._held, self._burst_s = None, at_s
            return []
        done = [self._held.key] if self._held is not None else []
        self._held = _Held(key, at_s)
        return done

    def due(self, at_s: float) -> list[str]:
        """Return the key that counts because nothing followed it."""
        if self._held is None or at_s - self._held.since_s < ALONE_S:
            return []
        key, self._held = self._held.key, None
        return [key]

    def burst_ended(self, at_s: float) -> bool:
        """Tell once that a burst was dropped, when it is over."""
        if self._burst_s is None or at_s - self._burst_s < ALONE_S:
            return False
        self._burst_s = None
        return True
