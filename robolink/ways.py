"""What a sentence tells a person to give or to use, in the words of whoever shows it.

An error of the library says what to do next. Its Python user gives an argument for that, a person
at a shell an option. So the sentence leaves a place for it, and the program that shows the
sentence says with :func:`speaking` how its users say each of them.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum, unique


@unique
class Way(StrEnum):
    """What a sentence may ask for; the value is how a Python program says it."""

    ACCEPT_JUMP = "accepted_change_mm"
    ANSWER = "Answers(texts={{{number}: TEXT}})"
    CALIBRATE_AT = "ToolPlan(..., pin={station!r})"
    CALIBRATE_CAMERA_AT = "the method camera-affine, with tool {tool} at {station!r}"
    CALIBRATE_TOOL_AT = "ToolPlan({tool}, ..., pin={station!r})"
    DIALOGUE_FILE = "DialogueLog"
    EARLIER_VALUE = "to=NUMBER"
    EXPORT_JOURNAL = "open_journal(..., read_only=True)"
    FORGET_MARKER = "recover(..., confirm=...)"
    GIVEN_POSES = "PointsSource"
    HEIGHT = "Answers(z_mm={{{tool}: MM}})"
    LENGTH_TOLERANCE = "length_mm=0.05"
    LIST_CHANGES = "outcomes.recorded(kinds=(EntryKind.DONE,))"
    LOT = "Answers(lot=ID)"
    NOZZLE = "Answers(nozzle=ID)"
    OPERATOR = "connect(..., signature=...)"
    OTHER_CONTROLLER = "leave require_same_controller out"
    OVERWRITE = "replace=True"
    PASSWORD = "connect(..., password=...)"
    RECORD = "trace"
    REFERENCE = "reference=True"
    REMOTE_TIMEOUT = "remote_timeout_s"
    SELECTED_TOO = "selected"
    SENSOR = "sensor"
    SIGMA = "sigma_mm"
    TAUGHT_POINTS = "taught_poses"
    TAUGHT_TOOL = "taught_tool"
    THEN_SELECT = "then_select=NUMBER"
    TILT = "tilt_deg"
    TOOL = "tool"
    TOOLS = "tools"
    YES = "Answers(yes=True)"


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


def way(which: Way, **values: object) -> str:
    """Return how the users of this program say ``which``, with its placeholders filled."""
    text = _spoken.get(which, which.value)
    return text.format(**values) if values else text
