"""What the bytes of a terminal mean as keys.

A POSIX terminal sends an escape sequence for a key that has no character (ECMA-48, with the
letters of xterm); a Windows console gives two characters, the first of them NUL or E0.
"""

from enum import Enum
from typing import Final


class Key(Enum):
    """A key that means something here."""

    RIGHT = "right"
    LEFT = "left"
    UP = "up"
    DOWN = "down"
    PAGE_UP = "page up"
    PAGE_DOWN = "page down"
    LESS = "<"
    GREATER = ">"
    PLUS = "+"
    MINUS = "-"
    YES = "y"
    NO = "n"
    END = "end"
    """q or ENTER."""


_ESCAPE: Final = "\x1b"
PLAIN: Final = {
    "<": Key.LESS,
    ">": Key.GREATER,
    "+": Key.PLUS,
    "-": Key.MINUS,
    "y": Key.YES,
    "Y": Key.YES,
    "j": Key.YES,
    "J": Key.YES,
    "n": Key.NO,
    "N": Key.NO,
    "q": Key.END,
    "Q": Key.END,
    "\r": Key.END,
    "\n": Key.END,
}
"""Characters that are keys by themselves."""

_SEQUENCES: Final = {
    "A": Key.UP,
    "B": Key.DOWN,
    "C": Key.RIGHT,
    "D": Key.LEFT,
    "5~": Key.PAGE_UP,
    "6~": Key.PAGE_DOWN,
}

WINDOWS: Final = {
    "H": Key.UP,
    "P": Key.DOWN,
    "M": Key.RIGHT,
    "K": Key.LEFT,
    "I": Key.PAGE_UP,
    "Q": Key.PAGE_DOWN,
}
"""The second character after NUL or E0 on a Windows console."""


class KeyDecoder:
    """Turns what a POSIX terminal sends into keys, wherever it is cut.

    An unknown sequence is swallowed whole, modifiers included: no tail of it may be taken
    for a key that moves a robot.
    """

    def __init__(self) -> None:
        self._held = ""

    @property
    def pending(self) -> bool:
        """Whether a sequence has begun and not ended."""
        return bool(self._held)

    def feed(self, text: str) -> list[Key]:
        """Return the keys that ``text`` completes."""
        return [key for character in text for key in self._take(character)]

    def flush(self) -> None:
        """Forget a sequence that never ended: ESC was pressed alone."""
        self._held = ""

    def _take(self, character: str) -> list[Key]:
        if character == _ESCAPE:
            self._held = character
            return []
        if not self._held:
            return [PLAIN[character]] if character in PLAIN else []
        self._held += character
        if self._held in ("\x1b[", "\x1bO") or not _ends_sequence(self._held):
            return []
        body, self._held = self._held[2:], ""
        return [_SEQUENCES[body]] if body in _SEQUENCES else []


def _ends_sequence(held: str) -> bool:
    """Tell whether ``held`` is a whole sequence: ESC, one byte, or ESC [ ... letter or ~."""
    if held[1] not in "[O":
        return True
    return "@" <= held[-1] <= "~"
