"""Requests as clients by others send them: a blank first, a letter of no manual."""

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.options import options_from_text

from robolink.protocols import Role
from robolink.protocols.epson_binary import EpsonBinaryCodec
from robolink.protocols.epson_text import EpsonTextCodec, Refusal, Reply, Request

NS = 1_000_000_000


class Line:
    """A line into a simulated controller, whose time a test steps."""

    def __init__(self, *, serial=False, **options):
        self.simulator = EpsonSimulator(options=options_from_text(options))
        connect = self.simulator.connect_serial if serial else self.simulator.connect
        self.link, self.now_ns = connect(0), 0

    def say(self, data):
        """Send bytes; return what came within a fifth of a second."""
        self.link.receive(data, self.now_ns)
        self.now_ns += NS // 5
        self.simulator.advance(self.now_ns)
        return self.link.outgoing()


def frame(letter, data=b""):
    body = letter + data + b"\x03"
    checksum = 0
    for byte in body:
        checksum ^= byte
    return b"\x02" + body + bytes([checksum])


@pytest.mark.parametrize("blanks", [b" ", b"\t", b"   "], ids=["a blank", "a tab", "three blanks"])
def test_a_blank_before_the_dollar_sign_is_one_refusal_or_is_skipped(blanks):
    line = Line()
    assert line.say(b"$Login\r\n") == b"#Login,0\r\n"
    answer = line.say(blanks + b"$GetStatus\r\n")
    assert answer.count(b"\r\n") == 1
    assert answer.startswith(b"!")
    assert answer.endswith(b",10\r\n")
    line = Line(blank_before_dollar="skipped")
    line.say(b"$Login\r\n")
    assert line.say(blanks + b"$GetStatus\r\n").startswith(b"#GetStatus,")


def test_requests_without_line_ends_are_still_told_apart():
    device = EpsonTextCodec(Role.DEVICE, unterminated=True)
    device.receive_data(b"$GetStatus$Stop\r\n")
    events = [device.next_event() for _ in range(2)]
    assert events == [Request("GetStatus"), Request("Stop")]


@pytest.mark.parametrize("letter", [b"D", b"z", b"?", b"\xe9"])
def test_a_letter_of_no_manual_is_refused_with_that_letter(letter):
    line = Line(serial=True)
    line.say(b"\x04")
    line.say(frame(b"L"))
    answer = line.say(frame(letter))
    assert answer[:2] == b"\x15" + letter
    host = EpsonBinaryCodec(Role.HOST)
    host.receive_data(answer)
    assert host.next_event() == Refusal("", 11)
    assert not line.link.closed


@pytest.mark.parametrize(
    ("options", "flags"),
    [({}, 11), ({"rc_plus": "5"}, 10), ({"rc_plus": "5", "status_flags": "11"}, 11)],
)
def test_rc_plus_5_has_ten_flags_unless_it_is_said_otherwise(options, flags):
    line = Line(**options)
    line.say(b"$Login\r\n")
    host = EpsonTextCodec(Role.HOST)
    host.receive_data(line.say(b"$GetStatus\r\n"))
    reply = host.next_event()
    assert isinstance(reply, Reply)
    assert len(reply.fields[0]) == flags
