"""How a sentence names what a person should give or use, in the words of the front end.

An error of the library says what to do next. Its Python user gives an argument for that, a person
at a shell an option. So the sentence leaves a place for it, and the program that shows the
sentence says with :func:`speaking` how its users say each of them.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Final


class RemedyWord:
    """What a sentence may ask for, as a Python program says it; each is its own key.

    Plain texts and no enumeration, because a stop loads them before its first frame.
    """

    ACCEPT_CHANGE: Final = "change_guard.accepting(tool, jump)"
    ACCEPT_JUMP: Final = "accepted_change_mm"
    ANSWER: Final = "Answers(texts={{{number}: TEXT}})"
    AXES_HELD: Final = "axes_held=True"
    BOX: Final = "reach_mm"
    CALIBRATE_AT: Final = "ToolPlan(..., pin={station!r})"
    CALIBRATE_CAMERA_AT: Final = "the method camera-affine, with tool {tool} at {station!r}"
    CALIBRATE_TOOL_AT: Final = "ToolPlan({tool}, ..., pin={station!r})"
    COLUMNS: Final = "columns"
    DIALOGUE_FILE: Final = "DialogueLog"
    EARLIER_VALUE: Final = "to=NUMBER"
    END_HOLDER: Final = "robolink.stopping.end_process"
    EULER: Final = "euler"
    EXPORT_JOURNAL: Final = "open_journal(..., read_only=True)"
    FORGET_MARKER: Final = "recover(..., confirm=...)"
    GIVEN_POSES: Final = "PointsSource"
    HEIGHT: Final = "Answers(z_mm={{{tool}: MM}})"
    LENGTH: Final = 'ToolPlan(..., length="difference")'
    LENGTH_UNIT: Final = "length"
    LENGTH_TOLERANCE: Final = "length_mm=0.05"
    LIST_CHANGES: Final = "outcomes.recorded(kinds=(EntryKind.DONE,))"
    LOT: Final = "Answers(lot=ID)"
    NOZZLE: Final = "Answers(nozzle=ID)"
    OPERATOR: Final = "connect(..., signature=...)"
    OTHER_CONTROLLER: Final = "leave require_same_controller out"
    OVERWRITE: Final = "replace=True"
    PASSWORD: Final = "connect(..., password=...)"
    RECORD: Final = "trace"
    REFERENCE: Final = "reference=True"
    REMOTE_TIMEOUT: Final = "remote_timeout_s"
    RENEW_CERTIFICATE: Final = "make_own_certificate(replace=True)"
    SELECTED_TOO: Final = "selected"
    SENSOR: Final = "sensor"
    SIGMA: Final = "sigma_mm"
    TAUGHT_POINTS: Final = "taught_poses"
    TAUGHT_TOOL: Final = "taught_tool"
    THEN_SELECT: Final = "then_select=NUMBER"
    TILT: Final = "tilt_deg"
    TOOL: Final = "tool"
    TOOLS: Final = "tools"
    TURN: Final = "turn_in_air(here, {turn:+g}, lift_mm=10)"
    WAIT: Final = "wait_s=SECONDS"
    YES: Final = "Answers(yes=True)"


_spoken: Mapping[str, str] = {}


@contextmanager
def speaking(words: Mapping[str, str]) -> Iterator[None]:
    """Use these words for the ways that they name, inside the block and in the whole process."""
    global _spoken  # noqa: PLW0603 - one program shows the sentences of a process
    before = _spoken
    _spoken = words
    try:
        yield
    finally:
        _spoken = before


def remedy_word(which: str, /, **values: object) -> str:
    """Return how the users of this program say ``which``, with its placeholders filled."""
    text = _spoken.get(which, which)
    return text.format(**values) if values else text
