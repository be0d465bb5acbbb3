"""The one place at which text leaves for a console.

What is shown holds words of controllers, of people and of files, and a terminal obeys what it
is sent: an escape sequence clears the screen, rewrites a line that was read already, or types
an answer. So every control character but the line feed is shown as an escape, whatever it
came with, and so are the marks that turn the direction of writing. Colour comes from rich,
which is handed texts that went through :func:`visible` first.
"""

import re
import sys
from typing import Final

import click

_OBEYED: Final = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f"  # C0 without LF, DEL, C1
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]"  # line separators, direction of writing
)


def visible(text: str) -> str:
    r"""Return ``text`` with everything that a terminal would obey as ``\x1b`` or ``\u202e``.

    CRLF, with which controllers end their lines, is a line feed.
    """
    lines = text.replace("\r\n", "\n")
    return _OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), lines)


def show(text: str, *, beside: bool = False) -> None:
    """Show a person a text.

    Args:
        text: One line or several.
        beside: On stderr, beside the result.
    """
    # The stream is named, because click takes an ASCII console for a misunderstanding and
    # would send it UTF-8.
    click.echo(visible(text), file=sys.stderr if beside else sys.stdout)


def hand_over(document: str) -> None:
    """Write JSON for a program; it is ASCII, and escapes what it holds by itself."""
    click.echo(document)
