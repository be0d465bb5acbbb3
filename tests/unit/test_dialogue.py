"""Recorded dialogues as text."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError
from robolink.transport import (
    SECRET_PLACEHOLDER,
    Dialogue,
    DialogueLog,
    Passage,
    format_dialogue,
    parse_dialogues,
)

passages = st.builds(
    Passage,
    st.integers(0, 10_000_000).map(lambda us: us / 1e6),
    st.sampled_from(["sent", "received"]),
    st.binary(max_size=40),
)
dialogues = st.builds(
    Dialogue, st.text(max_size=20), st.text(max_size=20), st.lists(passages, max_size=6).map(tuple)
)


@settings(max_examples=60, deadline=None)
@given(st.lists(dialogues, min_size=1, max_size=3))
def test_what_is_written_is_read_back(made):
    text = "".join(format_dialogue(dialogue) for dialogue in made)
    assert text.isascii()
    assert parse_dialogues(text, source="a test") == tuple(made)


def test_a_login_is_kept_as_a_mark_and_not_as_bytes():
    log = DialogueLog("here", "now")
    log(5_000_000_000, "sent", SECRET_PLACEHOLDER)
    log(5_250_000_000, "received", b"#Login,0\r\n")
    assert log.dialogue.passages == (
        Passage(0.0, "sent", b"", secret=True),
        Passage(0.25, "received", b"#Login,0\r\n"),
    )
    assert SECRET_PLACEHOLDER.decode() not in format_dialogue(log.dialogue)
    assert parse_dialogues(format_dialogue(log.dialogue), source="") == (log.dialogue,)


def test_pieces_of_one_direction_are_joined_and_a_login_stays_apart():
    pieces = (
        Passage(0.0, "sent", b"", secret=True),
        Passage(0.1, "sent", b"$Get"),
        Passage(0.2, "sent", b"Status\r\n"),
        Passage(0.3, "received", b"#Get"),
        Passage(0.4, "received", b"Status,1,0\r\n"),
    )
    joined = Dialogue("", "", pieces).joined().passages
    assert [piece.data for piece in joined] == [b"", b"$GetStatus\r\n", b"#GetStatus,1,0\r\n"]
    assert [piece.at_s for piece in joined] == [0.0, 0.1, 0.3]


OPENING = '{"schema": "robolink/dialogue/1", "controller": "c", "began_at": "t"}\n'


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", 1),
        ('{"t_s": 0, "sent": "x"}\n', 1),
        ('{"schema": "another/1"}\n', 1),
        (OPENING + "no json\n", 2),
        (OPENING + "[]\n", 2),
        (OPENING + '\n{"t_s": 0}\n', 3),
        (OPENING + '{"t_s": "soon", "sent": "x"}\n', 2),
        (OPENING + '{"t_s": 0, "sent": 5}\n', 2),
        (OPENING + '{"t_s": 0, "sent": "\\u20ac"}\n', 2),
    ],
)
def test_the_first_line_that_does_not_belong_there_is_named(text, line):
    with pytest.raises(ConfigError, match=f"Line {line} of a file"):
        parse_dialogues(text, source="a file")
