"""The form of an error on a screen: what happened, what stands, what to do.

In a sentence a long path or URL is shown by its name. It is listed whole on a line of its own
below, as findings are: there it can be copied, and the sentence can be read.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Final

from robolink.messages import LIST_LINE, joined, listed
from robolink_cli.console.output import visible
from robolink_cli.console.tables import columns, within

MOST_LINES: Final = 3
"""So many lines of a screen an error takes, besides those of lists."""

LONGEST_NAME: Final = 32
"""Longest path or URL, in columns, that a sentence holds."""

_ENDS: Final = ".,:;?!)]}\u3002\uff0c\uff1a\uff1b\uff01\uff1f\uff09\u3001\u201d"
"""Signs that end a sentence or a part of one, and no path."""

_NAMES: Final = (
    r"(?P<command>'robolink [^']*')|"
    r"(?<![A-Za-z0-9_.~:/\\+-])"
    r"(?:[a-z][a-z0-9+.-]*://|~?/|[A-Za-z]:[\\/]|\\\\)"
    r"[^\s'\"\u3002\uff0c\uff1a\uff1b\uff01\uff1f\uff08\uff09\u3001\u201c\u201d]+"
)
"""Pattern for a URL, an absolute path, or a quoted command, which stays whole."""

_SENTENCE_END: Final = r"(?<=[.?!]) |(?<=[\u3002\uff1f\uff01]) ?"
"""Pattern for what stands between two sentences."""

_CONTINUED: Final = r"\s+\S*[/\\]"
"""Pattern for what follows a part of a path that holds a blank."""


def error_lines(
    what: str, do: str = "", *, stands: Sequence[str] = (), then: str = "", width: int
) -> str:
    """Return what is shown of an error.

    Where it would take more than three lines, what stands is listed below what happened. Where it
    still would, because more was advised on the way up, the last sentences of what to do give way:
    the first, and the next command, are always shown, and JSON has all.

    Args:
        what: What happened.
        do: What to do.
        stands: What stands on the controller, sentence by sentence.
        then: The sentence with the next command.
        width: Columns of the terminal; 0 leaves each sentence as it is, for a file or a program.

    Example:
        >>> from robolink_cli.console.error_lines import error_lines
        >>> path = "/home/kowalski/.local/share/robolink/journal.db"
        >>> print(error_lines(f"{path} is empty.", "Give another file.", width=80))
        robolink: journal.db is empty.
            /home/kowalski/.local/share/robolink/journal.db
          Give another file.
    """
    what, do, then, *stands = map(visible, (what, do, then, *stands))
    steps = joined(" ", filter(None, (do, then)))
    shown = _in_lines((what, joined(" ", stands), steps), width)
    advised = re.split(_SENTENCE_END, do)
    for many in range(len(advised), 0 if not then else -1, -1):
        if not width or counted(shown) <= MOST_LINES:
            break
        steps = joined(" ", filter(None, (*advised[:many], then)))
        shown = _in_lines((listed(what, stands), steps), width)
    return shown


def counted(shown: str) -> int:
    """Return how many lines an error takes, besides those of lists."""
    return sum(not line.startswith(LIST_LINE) for line in shown.split("\n"))


def _in_lines(parts: Iterable[str], width: int) -> str:
    first, *rest = parts
    lines = [f"robolink: {first}", *(f"  {one}" for one in rest if one)]
    return "\n".join(within(_long_names_below(one), width) if width else one for one in lines)


def _long_names_below(text: str) -> str:
    """Return a text with the long names of its sentence listed whole below it."""
    sentence, line_end, rest = text.partition("\n")
    whole = []

    def named(found: "re.Match[str]") -> str:
        name = found[0].rstrip(_ENDS)
        beyond = sentence[found.start() + len(name) :]
        if found["command"] or columns(name) <= LONGEST_NAME or re.match(_CONTINUED, beyond):
            return found[0]
        whole.append(f"{LIST_LINE}{name}")
        return _short(name) + found[0][len(name) :]

    sentence = re.sub(_NAMES, named, sentence)
    return "\n".join([sentence, *dict.fromkeys(whole)]) + line_end + rest


def _short(name: str) -> str:
    """Return the last part of a path, the address in a URL, of a still too long name its ends."""
    _, is_url, address = name.partition("://")
    last = address.partition("?")[0] if is_url else re.split(r"[/\\]", name.rstrip("/\\"))[-1]
    return last if columns(last) <= LONGEST_NAME else f"{last[:20]}...{last[-8:]}"
