"""Recorded dialogues: as text, replayed, and bounded."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.device import wire_record
from robolink_simulators.device.wire_record import WireLine, WireRecord
from robolink_simulators.hosting.replay import ReplayDevice, read_recording

from robolink.errors import ConfigError
from robolink.transport import (
    SECRET_PLACEHOLDER,
    Dialogue,
    DialogueLog,
    Passage,
    format_dialogue,
    parse_dialogues,
)
from tests._rows import each_row

# Recorded dialogues as text.

passages = st.builds(
    Passage,
    st.integers(0, 10_000_000).map(lambda us: us / 1e6),
    st.sampled_from(["sent", "received"]),
    st.binary(max_size=40),
)
dialogues = st.builds(
    Dialogue, st.text(max_size=20), st.text(max_size=20), st.lists(passages, max_size=6).map(tuple)
)


@settings(max_examples=30, deadline=None)
@given(st.lists(dialogues, min_size=1, max_size=3))
def test_what_is_written_is_read_back(made):
    text = "".join(format_dialogue(dialogue) for dialogue in made)
    assert text.isascii()
    assert parse_dialogues(text, source="a test") == tuple(made)


def test_a_login_is_kept_as_a_mark_and_not_as_bytes():
    log = DialogueLog("here", "now")
    log(5_000_000_000, "sent", SECRET_PLACEHOLDER)
    log(5_250_000_000, "received", b"#Login,0\r\n")
    log(5_500_000_000, "received", SECRET_PLACEHOLDER)
    assert log.dialogue.passages == (
        Passage(0.0, "sent", b"", secret=True),
        Passage(0.25, "received", b"#Login,0\r\n"),
        Passage(0.5, "received", b"", secret=True),
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


@each_row(
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


# A recorded dialogue, served without a socket.


def sent(data):
    return Passage(0.0, "sent", data)


def received(data):
    return Passage(0.0, "received", data)


LOGIN = Passage(0.0, "sent", b"", secret=True)
STATUS = b"#GetStatus,00100000001,0000\r\n"
RECORDED = Dialogue(
    "a controller",
    "a day",
    (LOGIN, received(b"#Login,0\r\n"), sent(b"$GetStatus\r\n"), received(STATUS)),
)


def played(*pieces, dialogue=RECORDED):
    """Return the device and its answer to each piece; stop when it closes."""
    device = ReplayDevice((dialogue,))
    link = device.connect(0)
    answers = [link.outgoing()]
    for piece in pieces:
        link.receive(piece, 0)
        answers.append(link.outgoing())
    return device, link, b"".join(answers)


@each_row("login", [b"$Login,any password\r\n", b"$login,\r", b"$Login,x\n"])
def test_the_same_requests_get_the_same_answers_with_any_password(login):
    device, link, answers = played(login, b"$GetStatus\r\n", b"")
    assert answers == b"#Login,0\r\n" + STATUS
    assert device.differences == []
    assert link.closed


@each_row("cut", range(1, 12))
def test_how_the_stream_is_cut_does_not_matter(cut):
    stream = b"$Login,secret\r\n$GetStatus\r\n"
    device, _, answers = played(stream[:cut], *(bytes([b]) for b in stream[cut:]))
    assert answers == b"#Login,0\r\n" + STATUS
    assert device.differences == []


def test_what_was_received_unasked_is_sent_unasked():
    dialogue = Dialogue("", "", (received(b"!Execute,99\r\n"), sent(b"$Logout\r\n")))
    assert played(dialogue=dialogue)[2] == b"!Execute,99\r\n"


def test_another_request_is_refused_by_cutting_and_named():
    device, link, answers = played(b"$Login,x\r\n", b"$GetIO,3\r\n")
    assert answers == b"#Login,0\r\n"
    assert link.closed
    (difference,) = device.differences
    assert "Request 2" in difference
    assert "$GetIO,3" in difference
    assert "$GetStatus" in difference


def test_a_request_past_the_end_and_one_in_place_of_a_login_are_named():
    device, _, _ = played(b"$Login,x\r\n", b"$GetStatus\r\n", b"$GetStatus\r\n")
    assert "nothing more was recorded" in device.differences[0]
    device, _, _ = played(b"$GetStatus\r\n")
    assert "a login was recorded" in device.differences[0]


def test_a_password_is_never_shown():
    dialogue = Dialogue("", "", (sent(b"$GetStatus\r\n"),))
    device, _, _ = played(b"$Login,hush\r\n", dialogue=dialogue)
    assert "hush" not in device.differences[0]
    assert "***" in device.differences[0]


def test_a_client_that_leaves_early_is_noted_and_one_that_asked_all_is_not():
    device, _, _ = played(b"$Login,x\r\n", b"")
    assert "after request 1; 1 more" in device.differences[0]
    assert played(b"$Login,x\r\n", b"$GetStatus\r\n", b"")[0].differences == []


def test_the_end_of_the_stream_is_replayed():
    dialogue = Dialogue("", "", (sent(b"$Logout\r\n"), received(b"#Logout,0\r\n"), received(b"")))
    device, link, answers = played(b"$Logout\r\n", dialogue=dialogue)
    assert answers == b"#Logout,0\r\n"
    assert link.closed
    assert device.differences == []


def test_each_connection_gets_its_own_dialogue_and_one_too_many_is_cut():
    told: list[str] = []
    device = ReplayDevice((RECORDED, RECORDED), on_difference=told.append)
    assert device.unplayed == 2
    links = [device.connect(0) for _ in range(3)]
    assert [link.closed for link in links] == [False, False, True]
    assert device.unplayed == 0
    assert told == device.differences
    assert "Connection 3" in told[0]


@pytest.mark.parametrize("content", [None, b"\xff\xfe", b"not a recording\n"])
def test_a_file_that_is_no_recording_is_a_mistake_of_the_person(tmp_path, content):
    path = tmp_path / "recording.jsonl"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match="recording"):
        read_recording(path)


def test_a_recording_of_a_plc_is_served_by_no_epson(tmp_path):
    path = tmp_path / "recording.jsonl"
    path.write_text(format_dialogue(Dialogue("softmotion+modbus-tcp://192.0.2.1", "now", ())))
    with pytest.raises(ConfigError, match="only an EPSON controller can be replayed"):
        read_recording(path)


# The record of the wire traffic: bounded, numbered, and each text stored once.


def text(number):
    return f"GetIO,{number}"


def test_two_records_hold_the_same_text_once():
    one, another = WireRecord(), WireRecord()
    one.add(1, ">", text(5))
    another.add(2, ">", text(5))
    assert next(iter(one))[2] is next(iter(another))[2]


def test_texts_that_no_record_holds_are_let_go():
    record = WireRecord(most=10)
    for number in range(3 * wire_record.MOST_SHARED):
        record.add(number, "<", text(number))
        assert len(wire_record._shared) <= wire_record.MOST_SHARED
    assert [line.text for line in record.lines()] == [text(it) for it in range(12278, 12288)]


def test_what_was_pushed_out_has_been_counted():
    record = WireRecord(most=2)
    for number in (1, 2, 3):
        record.add(10 * number, ">", text(number))
    assert (record.added, len(record)) == (3, 2)
    assert list(record.lines(after=2)) == [WireLine(3, 30, ">", text(3))]
    assert [line.number for line in record.lines()] == [2, 3]
    record.clear()
    assert (record.added, list(record.lines())) == (0, [])
