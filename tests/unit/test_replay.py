"""A recorded dialogue, served without a socket."""

import pytest
from robolink_simulators.hosting.replay import ReplayDevice, read_recording

from robolink.errors import ConfigError
from robolink.transport import Dialogue, Passage


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
    """Return the device and what it answered to each piece; stop when it closes."""
    device = ReplayDevice((dialogue,))
    link = device.connect(0)
    answers = [link.outgoing()]
    for piece in pieces:
        link.receive(piece, 0)
        answers.append(link.outgoing())
    return device, link, b"".join(answers)


@pytest.mark.parametrize("login", [b"$Login,any password\r\n", b"$login,\r", b"$Login,x\n"])
def test_the_same_requests_get_the_same_answers_with_any_password(login):
    device, link, answers = played(login, b"$GetStatus\r\n", b"")
    assert answers == b"#Login,0\r\n" + STATUS
    assert device.differences == []
    assert link.closed


@pytest.mark.parametrize("cut", range(1, 12))
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
