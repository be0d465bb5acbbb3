"""What keys and words mean: the keypad with and without NumLock, and two languages of words."""

import unicodedata
from typing import Final, NamedTuple

KEYPAD: Final = {
    "left": "4",
    "right": "6",
    "up": "8",
    "down": "2",
    "pageup": "9",
    "pagedown": "3",
    "end": "1",
    "home": "7",
    "insert": "0",
}
"""Keypad digits by the names of keys: the keypad without NumLock, and the keys of a notebook."""

AXES: Final = {
    "6": "x+",
    "4": "x-",
    "8": "y+",
    "2": "y-",
    "9": "z+",
    "3": "z-",
    "7": "u+",
    "1": "u-",
}
"""Jog axis and direction by key."""

_ARROWS: Final = ("6", "8", "4", "2")
"""Arrow keys in counter-clockwise order, seen from above."""

_WORDS: Final = {
    "take": "take done record t 记录",
    "stop": "stop q quit abort end 停止",
    "again": "again redo back 重做 返回",
    "more": "more 再触碰",
    "help": "help ? h 帮助",
    "yes": "y yes j ja 是",
    "no": "n no nein 否",
    "report": "report 报告",
    "next": "next 下一个",
    "finish": "finish 结束",
    "zh": "chinese zh 中文",
    "en": "english en 英文",
}
_MEANINGS: Final = {word: meaning for meaning, words in _WORDS.items() for word in words.split()}


def folded(text: str) -> str:
    """Return typed text in narrow letters: a Chinese input method sends wide ones."""
    return unicodedata.normalize("NFKC", text).strip().casefold()


def meaning_of(text: str) -> str:
    """Return the command of a typed line: ``take``, ``stop`` ..; empty for none.

    The number after ``again 1`` is read by :func:`number_in`.
    """
    words = folded(text).split()
    meaning = _MEANINGS.get(words[0], "") if words else ""
    alone = len(words) == 1 or (meaning == "again" and len(words) == 2 and words[1].isdigit())
    return meaning if alone else ""


def number_in(text: str) -> int | None:
    """Return the number of a touch in ``again 1``, ``None`` where none is named."""
    words = folded(text).split()
    return int(words[1]) if len(words) == 2 and words[1].isdigit() else None


def pose_in(text: str) -> str | None:
    """Return the numbers behind ``pose``, ``None`` if the line has none."""
    word, _, rest = folded(text).partition(" ")
    return rest if word in ("pose", "位姿") else None


def step_of(key: str, size: float, quarters: int) -> str | None:
    """Return the jog step of a key, ``None`` if it is none.

    Args:
        key: Its name.
        size: Step size, mm or degrees.
        quarters: By how many quarter turns the arrows are turned.
    """
    if key in _ARROWS:
        key = _ARROWS[(_ARROWS.index(key) + quarters) % 4]
    axis = AXES.get(key)
    return None if axis is None else f"{axis}{size:g}"


ALONE_S: Final = 0.035
"""Pause in seconds after a key without which it does not count."""

REPEATS_S: Final = 0.012
"""Shortest interval in seconds at which a held key repeats. A scanner sends the same digit twice
faster than this.
"""

AT_ONCE: Final = frozenset({"escape", "c-c"})
"""Keys that stop, and that take effect without waiting."""

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
    """A key, and the latest time at which it came."""

    key: str
    at_s: float


class KeyGate:
    """Passes single keys, and ignores bursts. Times are those of one monotonic clock."""

    def __init__(self) -> None:
        self._held: CountedKey | None = None
        self._last: CountedKey | None = None
        self._burst_s: float | None = None

    def press(
        self, key: str, at_s: float, quiet_s: float | None = None, *, stops: bool = False
    ) -> list[CountedKey]:
        """Accept a key; return those that count by now, in order.

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
        """Accept several keys that came in one piece, of which none counts.

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
        """Return the key that counts because nothing followed it for a time."""
        if self._held is None or at_s - self._held.at_s < ALONE_S:
            return []
        held, self._held = self._held, None
        return [held]

    def burst_ended(self, at_s: float) -> bool:
        """Report once, at its end, that a burst was ignored."""
        if self._burst_s is None or at_s - self._burst_s < ALONE_S:
            return False
        self._burst_s = None
        return True
