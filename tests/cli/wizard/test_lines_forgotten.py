"""Lines that were typed before there was anything to answer, in the wizard of lines."""

import pytest
from robolink_cli.wizard.faces.lines import LineFace
from robolink_cli.wizard.happenings import WaitsForAnswer, WasAsked
from robolink_cli.wizard.work import Desk

from robolink.runner import Question
from tests.cli.wizard._people import Sitting, touch_subject, write_subject


class Typed:
    """Lines that wait in the input."""

    def __init__(self, *lines):
        self.lines = list(lines)

    def next(self, wait_s):
        return self.lines.pop(0) if self.lines else None

    def forget(self, quiet_s):
        lines, self.lines = self.lines, []
        return lines


def told(face, hand, happening, line):
    """Let a line be typed, and then something happen; return what is left of it."""
    face._lines = Typed(line)
    face._tell(happening, hand.state)
    return face._lines.lines


@pytest.mark.parametrize(
    ("subject", "kind", "line"),
    [(write_subject(1), Question.YES_NO, "1"), (touch_subject(), Question.PLACE, "x+0.1")],
)
def test_neither_a_question_nor_the_end_of_a_movement_finds_an_answer_there(
    subject, kind, line, capsys
):
    hand, face = Sitting().asked(subject, kind), LineFace()
    number = hand.number
    assert told(face, hand, WasAsked(number, "?", kind, hand.now), line) == []
    assert told(face, hand, WaitsForAnswer(number, hand.now), line) == []
    if kind is Question.PLACE:
        # It waits for the next step at the same question: the robot has moved meanwhile.
        assert told(face, hand, WaitsForAnswer(number, hand.now), line) == []
    assert "Typed too early, so it was not taken" in capsys.readouterr().err
    face._lines = Typed(line)
    assert not face._listen(Desk(), hand.state).waits, "one that is typed now is the answer"
