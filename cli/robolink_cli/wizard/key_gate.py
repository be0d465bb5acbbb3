"""Which keys count: pressed by a hand, alone, and not held from before.

A scanner sends a bar code as keys within milliseconds and ends it with CR LF; a paste is faster
still. Two keys of a person are further apart. So a key is held back for a moment, and when another
one follows, neither counts (docs/decisions/0041). A key that is held down repeats by itself, always
the same one, never faster than a terminal repeats: those count one by one.

The times are those at which keys came to the terminal, not those at which a busy process gets to
them. What is not known to be apart is not taken for a hand.
"""

from typing import Final, NamedTuple

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
    "c-i": "tab",
    **KEYPAD,
}


def name_of(key: str) -> str:
    """Return the name by which the flow knows a key of a terminal."""
    return _NAMES.get(key, key)


class CountedKey(NamedTuple):
    """A key, and by when it had come."""

    key: str
    at_s: float


class KeyGate:
    """Lets single keys through, and drops bursts. Times are those of one monotonic clock."""

    def __init__(self) -> None:
        self._held: CountedKey | None = None
        self._last: CountedKey | None = None
        self._burst_s: float | None = None

    def press(
        self, key: str, at_s: float, quiet_s: float | None = None, *, stops: bool = False
    ) -> list[CountedKey]:
        """Take a key; return those that count by now, in their order.

        Args:
            key: The key.
            at_s: It had come by then.
            quiet_s: The last time at which it surely had not; by default it came at ``at_s``.
            stops: Whether it stops where the person is now, and so never waits either.
        """
        quiet_s = at_s if quiet_s is None else quiet_s
        if stops or key in AT_ONCE:
            self._held, self._burst_s = None, None
            self._last = CountedKey(key, at_s)
            return [CountedKey(key, at_s)]
        last, self._last = self._last, CountedKey(key, at_s)
        if self._burst_s is not None:
            if quiet_s - self._burst_s < ALONE_S:
                self._burst_s = at_s
                return []
            self._burst_s = None
        after_s = quiet_s - last.at_s if last else ALONE_S
        if last and after_s < ALONE_S and not (key == last.key and after_s >= REPEATS_S):
            self._held, self._burst_s = None, at_s
            return []
        done = [self._held] if self._held is not None else []
        self._held = self._last
        return done

    def burst(self, at_s: float, quiet_s: float | None = None) -> list[CountedKey]:
        """Take several keys that came in one piece, of which none counts.

        Args:
            at_s: They had come by then.
            quiet_s: As of :meth:`press`.

        Returns:
            The key before them, where it counts.
        """
        done = self.press("", at_s, quiet_s)
        self._held, self._burst_s = None, at_s
        return done

    def due(self, at_s: float) -> list[CountedKey]:
        """Return the key that counts because nothing had followed it by a time."""
        if self._held is None or at_s - self._held.at_s < ALONE_S:
            return []
        held, self._held = self._held, None
        return [held]

    def burst_ended(self, at_s: float) -> bool:
        """Tell once that a burst was dropped, when it is over."""
        if self._burst_s is None or at_s - self._burst_s < ALONE_S:
            return False
        self._burst_s = None
        return True
