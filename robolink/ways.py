"""What a sentence tells a person to give or to use, in the words of whoever shows it.

An error of the library says what to do next. Its Python user gives an argument for that, a person
at a shell an option. So the sentence leaves a place for it, and the program that shows the
sentence says with :func:`speaking` how its users say each of them.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum


class Way(StrEnum):
    """What a sentence may ask for; the value is how a Python program says it."""

    DIALOGUE_FILE = "DialogueLog"
    EARLIER_VALUE = "to=NUMBER"
    EXPORT_JOURNAL = "open_journal(..., read_only=True)"
    FORGET_MARKER = "recover(..., confirm=...)"
    GIVEN_POSES = "GivenPoses"
    LENGTH_TOLERANCE = "length_mm=0.05"
    LIST_CHANGES = "outcomes.recorded(kinds=(EntryKind.DONE,))"
    OPERATOR = "signature="
    OTHER_CONTROLLER = "leave require_same_controller out"
    OVERWRITE = "replace=True"
    PASSWORD = "connect(..., password=...)"
    RECORD = "trace"
    REMOTE_TIMEOUT = "remote_timeout_s"
    SELECTED_TOO = "selected"
    THEN_SELECT = "then_select=NUMBER"
    TOOL = "tool"
    TOOLS = "tools"


_spoken: Mapping[Way, str] = {}


@contextmanager
def speaking(words: Mapping[Way, str]) -> Iterator[None]:
    """Use these words for the ways that they name, inside the block and in the whole process."""
    global _spoken  # noqa: PLW0603 - one program shows the sentences of a process
    before = _spoken
    _spoken = words
    try:
        yield
    finally:
        _spoken = before


def way(which: Way) -> str:
    """Return how the users of this program say ``which``."""
    return _spoken.get(which, which.value)
