"""How many columns of a terminal a text takes: a Chinese character takes two."""

import re
from collections.abc import Iterator
from typing import Final

SCREEN: Final = 80
"""So many columns a whole screen has, on a wider terminal too."""

_WIDE: Final = "\u1100-\u115f\u2e80-\u303e\u3041-\ua4cf\uac00-\ud7a3\uf900-\ufaff\ufe30-\ufe6f"
_WIDE_FORMS: Final = "\uff00-\uff60\uffe0-\uffe6"
_CLOSING: Final = "\u3001\u3002\uff0c\uff1a\uff1b\uff01\uff1f\uff09\u201d\u300b,.:;!?)"
_OPENING: Final = "(\\[\uff08\u201c\u300a"
_HAS_WIDE: Final = f"[{_WIDE}{_WIDE_FORMS}]"
_PIECES: Final = (
    rf"[{_OPENING}]*[{_WIDE}{_WIDE_FORMS}][{_CLOSING}]*"
    rf"|[^\s{_WIDE}{_WIDE_FORMS}]+?(?=[{_OPENING}]*[{_WIDE}{_WIDE_FORMS}]|\s|$)[{_CLOSING}]*|\s+"
)
"""What stays on one line: a wide character with the signs about it, a word, a blank.

To compile such large sets costs more than all else of a help page, so that it is done on need.
"""
_WORDS: Final = r"\S+|\s+"
"""The same of a text without wide characters."""


def has_wide(text: str) -> bool:
    """Tell whether a text holds a character of two columns."""
    return not text.isascii() and re.search(_HAS_WIDE, text) is not None


def padded(text: str, width: int) -> str:
    """Return ``text`` with blanks behind it, ``width`` columns in all."""
    return text + " " * (width - columns(text))


def columns(text: str) -> int:
    """Return how many columns of a terminal a line takes."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len  # here, because English help pages do without rich

    return cell_len(text)


def filled(text: str, width: int, *, indent: str = "") -> str:
    """Return one paragraph in lines of at most ``width`` columns."""
    lines, line = [], indent
    for piece in re.findall(_WORDS if text.isascii() else _PIECES, text):
        piece = " " if piece.isspace() else piece
        if line.strip() and columns(line + piece.rstrip()) > width:
            lines.append(line.rstrip())
            line = indent
        if piece != " " or line.strip():
            line += piece
    return "\n".join([*lines, line.rstrip()])


def cut(text: str, width: int) -> str:
    """Return as much of a text as fits into a width."""
    if columns(text) <= width:
        return text
    kept = ""
    for character in text:
        if columns(kept + character) > width:
            break
        kept += character
    return kept


def pieces(row: str, width: int) -> Iterator[str]:
    """Yield a row that is one long word, such as a path, in pieces: nothing of it is lost."""
    while columns(row) > width:
        piece = cut(row, width)
        yield piece
        row = row[len(piece) :]
    yield row


def within(text: str, width: int) -> str:
    """Return a text whose long lines are broken at blanks, each as far from the edge as it began.

    Lines that fit keep their blanks.
    """
    return "\n".join(
        line
        if columns(line) <= width
        else filled(line, width, indent=line[: len(line) - len(line.lstrip())])
        for line in text.split("\n")
    )
