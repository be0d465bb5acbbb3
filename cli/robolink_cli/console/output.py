"""The one place at which text is written to a console, or to a reader who may leave.

What is shown holds words of controllers, of people and of files, and a terminal obeys what it
is sent: an escape sequence clears the screen, rewrites a line that was read already, or types
an answer. So every control character but the line feed is shown as an escape, whatever it
came with, and so are the marks that turn the direction of writing. Colour comes from rich,
which is handed texts that went through :func:`visible` first.

Whoever reads may close the pipe (``robolink ... | head -1``), the window or the line to it, in
the middle of a movement. The first write that fails ends the command in order
(:func:`robolink.interrupts.output_closed`); from then on everything that is shown goes nowhere,
so that the sentences of the cleaning up cannot break it off.
"""

import codecs
import io
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Final, TextIO

from robolink.interrupts import Interrupted, output_closed
from robolink_cli.console.person import Person, is_terminal, person_here
from robolink_cli.console.tables import filled, within

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


PLAINLY: Final = "robolink.plainly"
"""Name of the error handler for characters that an encoding lacks: letters instead of signs,
otherwise escapes.
"""

PLAIN: Final = "robolink.plain"
"""Key under which a command finds that plain lines are wanted instead of screens."""

_IN_ASCII: Final = {"\u00b1": "+-", "\u221e": "inf", "\u00b0": " deg", "\u2192": "->"}


def _plainly(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        return codecs.backslashreplace_errors(error)
    lacking = error.object[error.start : error.end]
    escaped = (
        _IN_ASCII.get(one) or one.encode("ascii", "backslashreplace").decode("ascii")
        for one in lacking
    )
    return "".join(escaped), error.end


codecs.register_error(PLAINLY, _plainly)


def tolerate_any_console() -> None:
    """Show characters that the console's encoding lacks as escapes, without an error.

    A technician's console may be cp1252, cp936 or plain ASCII, and a degree sign must not
    end a calibration; nor must a slip of the fingers that the encoding does not know.
    """
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=PLAINLY)


def colour_wanted() -> bool | None:
    """Return False when NO_COLOR asks for none, else None: only on a terminal."""
    return False if os.environ.get("NO_COLOR") else None


def help_width() -> int:
    """Return the width of help pages: the terminal's, between 50 and 78 columns.

    The rule is click's own; click would import ``shutil``, and with it the compression
    modules, to find out.
    """
    try:
        columns = int(os.environ.get("COLUMNS") or os.get_terminal_size().columns)
    except (OSError, ValueError):
        columns = 80
    return max(min(columns, 80) - 2, 50)


_OBEYED: Final = (
    "[\x00-\x09\x0b-\x1f\x7f-\x9f"  # C0 without LF, DEL, C1
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]"  # line separators, direction of writing
)

_NARROWEST: Final = 20


def visible(text: str) -> str:
    r"""Return ``text`` with each control character as ``\x1b`` or ``\u202e``.

    CRLF, with which controllers end their lines, is a line feed.
    """
    lines = text.replace("\r\n", "\n")
    if lines.replace("\n", "").isprintable():
        return lines  # nearly always: none of those characters is printable
    return re.sub(_OBEYED, lambda found: found[0].encode("unicode_escape").decode("ascii"), lines)


ShownBy = Callable[[str, bool], None]
"""Shows a text. Takes the text, and whether it is separate from the result."""

_shown_by: ShownBy | None = None


@contextmanager
def shown_by(shower: ShownBy) -> Iterator[None]:
    """Pass terminal output to another writer, for the block."""
    global _shown_by  # noqa: PLW0603 - a process has one terminal
    before, _shown_by = _shown_by, shower
    try:
        yield
    finally:
        _shown_by = before


def _is_shown_on(stream: TextIO) -> bool:
    """Return whether the present writer shows what goes to a stream: a terminal, or the wire."""
    return person_here() is Person.WIRE or is_terminal(stream)


def drawn_elsewhere() -> bool:
    """Return whether somebody else draws on the terminal now."""
    return _shown_by is not None and _is_shown_on(sys.stdout)


def show(text: str, *, beside: bool = False) -> None:
    """Show a person a text.

    Args:
        text: One line or several.
        beside: On stderr, beside the result.
    """
    if _shown_by is not None and _is_shown_on(sys.stderr if beside else sys.stdout):
        _shown_by(visible(text), beside)
        return
    draw(text, beside=beside)


def draw(text: str, *, beside: bool = False) -> None:
    """Write a text on the terminal: :func:`show` for the present writer.

    Args:
        text: One line or several.
        beside: On stderr, beside the result.
    """
    import click  # not above: doctor shows its findings even if click cannot be imported

    # The stream is given, because click considers an ASCII console a mistake and
    # would send it UTF-8.
    click.echo(visible(text), file=sys.stderr if beside else sys.stdout)


def sentences(text: str) -> str:
    """Return a text for people on stderr; no word is cut where that is a terminal.

    In a file, or for a reader who searches, a sentence stays one line.
    """
    width = terminal_width(sys.stderr)
    return within(text, width) if width else text


def beside(text: str, taken: int) -> str:
    """Return a text for stdout, broken to what a terminal has left beside a column of names.

    Args:
        text: One paragraph.
        taken: Columns of the names.
    """
    width = terminal_width(sys.stdout)
    return text if width - taken < _NARROWEST else filled(text, width - taken)


def terminal_width(stream: TextIO) -> int:
    """Return the number of columns, 0 if unknown or too few for a sentence.

    Args:
        stream: Where it is to stand.
    """
    try:
        width = os.get_terminal_size(stream.fileno()).columns if stream.isatty() else 0
    except (OSError, ValueError, AttributeError):
        return 0
    # A terminal without a known size reports 0.
    return width if width >= _NARROWEST else 0


def hand_over(document: str) -> None:
    """Write JSON for a program; it is ASCII, and escapes its own content."""
    import click

    click.echo(document)


class _Watched(io.FileIO):
    """A file that ends the command when it cannot be written to."""

    def write(self, data: "ReadableBuffer") -> int:
        """Write, or end the command; the rest is then discarded.

        Raises:
            Interrupted: The reader has left.
        """
        try:
            return super().write(data)
        except OSError:
            # EPIPE of a pipe, EIO of a closed terminal, ENOSPC of a file: in each case
            # nobody will ever see it.
            send_nowhere(self.fileno())
            output_closed()
            return memoryview(data).nbytes


def send_nowhere(descriptor: int) -> None:
    """Discard everything that is written to a descriptor from now on."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, descriptor)
        os.close(nowhere)


@contextmanager
def watched_output() -> Iterator[None]:
    """Watch stdout and stderr of this process, where they are real files, for the block."""
    with ExitStack() as stack:
        for name in ("stdout", "stderr"):
            stack.enter_context(_watched(name))
        yield


@contextmanager
def _watched(name: str) -> Iterator[None]:
    before = getattr(sys, name)
    if before is None:  # closed by the calling program: Python has no stream then
        with open(os.devnull, "w", encoding="ascii", errors="backslashreplace") as nowhere:
            setattr(sys, name, nowhere)
            try:
                yield
            finally:
                setattr(sys, name, None)
        return
    buffer = getattr(before, "buffer", None)
    raw = getattr(buffer, "raw", buffer)  # the same where Python was told not to buffer
    if type(before) is not io.TextIOWrapper or type(raw) is not io.FileIO:
        yield  # a Windows console, or a stream of the program that embeds this one
        return
    watched = _Watched(raw.fileno(), "wb", closefd=False)
    with suppress(OSError):
        before.flush()
    stream = io.TextIOWrapper(
        watched if buffer is raw else io.BufferedWriter(watched),
        encoding=before.encoding,
        errors=PLAINLY,
        newline=None if os.name == "nt" else "\n",
        line_buffering=before.line_buffering,
        write_through=before.write_through,
    )
    setattr(sys, name, stream)
    try:
        yield
    finally:
        with suppress(Interrupted):
            stream.flush()
        setattr(sys, name, before)
        stream.detach()
