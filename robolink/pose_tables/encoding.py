"""From the bytes of a file to lines of text.

A byte order mark decides. Without one, a text in which every other byte is 0 is UTF-16; what is
no UTF-8 comes from a Windows program. Only names and comments can suffer there: digits, signs and
separators are ASCII in every 8-bit encoding.
"""

import codecs
import re
from bisect import bisect_left
from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.values import UnusableText

_MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark is the beginning of this one
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_LOOKED_AT: Final = 4096
_LINE_END: Final = re.compile(r"\r\n|\r|\n")


def decoded(data: bytes) -> tuple[str, str]:
    """Return the text and the name of its encoding.

    Raises:
        UnusableText: It is no text.
    """
    name = next((name for mark, name in _MARKS if data.startswith(mark)), None) or _unmarked(data)
    try:
        text = data.decode(name)
    except UnicodeDecodeError as error:
        raise UnusableText(tr("it is not text in {encoding}", encoding=name)) from error
    if "\0" in text:
        raise UnusableText(tr("it is not text"))
    return text, name


def lines_of(text: str) -> list[str]:
    """Return the lines; only CR and LF end one, not Unicode's other line ends."""
    return _LINE_END.split(text)


def line_counter(text: str) -> Callable[[int], int]:
    """Return a function that gives the line number, from 1, of a place in ``text``."""
    ends = [found.start() for found in re.finditer("\n", text)]
    return lambda place: bisect_left(ends, place) + 1


def _unmarked(data: bytes) -> str:
    head = data[:_LOOKED_AT]
    half = len(head) // 2
    if half and head[1::2].count(0) > 0.6 * half and head[::2].count(0) < 0.1 * half:
        return "utf-16-le"
    if half and head[::2].count(0) > 0.6 * half and head[1::2].count(0) < 0.1 * half:
        return "utf-16-be"
    for name in ("utf-8", "cp1252"):
        try:
            data.decode(name)
        except UnicodeDecodeError:
            continue
        return name
    return "latin-1"  # it has a character for every byte
