"""A page as a terminal shows it: paragraphs filled to its width, the rest as it stands."""

import re
from collections.abc import Iterator
from typing import Final

from robolink_cli.console.columns import filled, has_wide, within

_AS_IT_STANDS: Final = re.compile(r"\s{4,}|[|#<>!]|```|\s*$")
_ITEM: Final = re.compile(r"\s*([*-]|\d+\.)\s")


def page_lines(text: str, width: int) -> str:
    """Return a page of Markdown for a terminal.

    The pages are wider than a terminal of 80 columns, which would break their lines in the middle
    of a word. Paragraphs and items of lists are filled anew; lines of tables, headings and code
    that are too long are broken at a blank.

    Args:
        text: The page.
        width: Columns of the terminal.
    """
    return "\n".join(
        filled(part, width, indent=part[: len(part) - len(part.lstrip())])
        if is_prose
        else within(part, width)
        for is_prose, part in _parts(text)
    )


def _parts(text: str) -> Iterator[tuple[bool, str]]:
    """Yield paragraphs and items, each joined to one line, and the other lines; and which it is."""
    prose, in_code = "", False
    for line in text.split("\n"):
        fence = line.startswith("```")
        stands = in_code or fence or _AS_IT_STANDS.match(line) is not None
        if prose and (stands or _ITEM.match(line)):
            yield True, prose
            prose = ""
        if stands:
            yield False, line
        else:
            prose = _joined(prose, line.strip()) if prose else line
        in_code ^= fence
    if prose:
        yield True, prose


def _joined(line: str, following: str) -> str:
    """Return two lines as one; Chinese has no blank between words."""
    return line + following if has_wide(line[-1]) else f"{line} {following}"
