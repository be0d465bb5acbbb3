"""Answers of the simulated PLC's Modbus port to slightly wrong requests.

Codes and limits: Modbus Application Protocol V1.1b3, sections 6 and 7.
"""

import struct

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.fieldbus.mailbox_frames import MailboxFrames
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator


@pytest.fixture(params=[None, 1], ids=["tcp", "rtu"])
def ask(request):
    """Send a PLC a request without its frame; return the answer without its frame."""
    device = MailboxFrames(SoftMotionSimulator(), ManualClock(), unit=request.param)
    link = device.connect(0)

    def asked(pdu):
        if request.param is None:
            link.receive(struct.pack(">HHHB", 7, 0, len(pdu) + 1, 1) + pdu, 0)
            return link.outgoing()[7:]
        frame = bytes([1]) + pdu
        link.receive(frame + checksum(frame), 0)
        return link.outgoing()[1:-2]

    return asked


def checksum(frame):
    value = 0xFFFF
    for byte in frame:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")


def registers(*values):
    return struct.pack(f">B{len(values)}H", 2 * len(values), *values)


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        (struct.pack(">BHH", 3, 0, 126), b"\x83\x03"),
        (struct.pack(">BHH", 4, 0, 0), b"\x84\x03"),
        (struct.pack(">BHH", 1, 0, 2001), b"\x81\x03"),
        (struct.pack(">BHH", 16, 300, 124) + registers(*[0] * 124), b"\x90\x03"),
        (struct.pack(">BHH", 3, 65000, 10), b"\x83\x02"),
        (struct.pack(">BHHHH", 23, 65000, 2, 400, 1) + registers(5), b"\x97\x02"),
        (struct.pack(">BHHHH", 23, 0, 126, 400, 1) + registers(5), b"\x97\x03"),
    ],
    ids=[
        "too many",
        "none",
        "too many coils",
        "too many written",
        "beyond",
        "23 beyond",
        "23 many",
    ],
)
def test_a_request_that_cannot_be_is_answered_by_its_exception(ask, asked, answered):
    assert ask(asked) == answered


def test_a_count_that_is_not_that_of_the_values_changes_nothing(ask):
    assert ask(struct.pack(">BHH", 6, 400, 7))[0] == 6
    said_two = struct.pack(">BHHB", 16, 400, 2, 2) + b"\0\x09"
    assert ask(said_two) == b"\x90\x03"
    assert ask(struct.pack(">BHH", 3, 400, 1)) == b"\x03\x02\0\x07"


def test_function_23_writes_before_it_reads(ask):
    both = struct.pack(">BHHHH", 23, 399, 3, 400, 2) + registers(0x0102, 0x0304)
    assert ask(both) == b"\x17\x06\0\0\x01\x02\x03\x04"


def test_a_function_that_it_has_not_is_refused_over_tcp(ask):
    assert ask(bytes([43, 14, 1, 0])) in (b"\xab\x01", b"")
