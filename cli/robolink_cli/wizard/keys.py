"""What keys and words mean: the keypad with and without NumLock, and two languages of words."""

import unicodedata
from typing import Final

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
"""Names of keys without NumLock: the same places of the keypad, and keys of a notebook."""

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
"""Which way a key jogs."""

_ARROWS: Final = ("6", "8", "4", "2")
"""Counter-clockwise, seen from above."""

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
    """Return which command a typed line is: ``take``, ``stop`` ..; empty for none.

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
    """Return the numbers behind ``pose``, ``None`` where the line is none."""
    word, _, rest = folded(text).partition(" ")
    return rest if word in ("pose", "位姿") else None


def step_of(key: str, size: float, quarters: int) -> str | None:
    """Return the jog step of a key, ``None`` where it is none.

    Args:
        key: Its name.
        size: Step size, mm or degrees.
        quarters: By how many quarter turns the arrows are turned.
    """
    if key in _ARROWS:
        key = _ARROWS[(_ARROWS.index(key) + quarters) % 4]
    axis = AXES.get(key)
    return None if axis is None else f"{axis}{size:g}"
