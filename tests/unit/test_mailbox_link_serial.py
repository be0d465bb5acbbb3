"""A serial port as a transport, on a pseudo terminal."""

import os
import tty

import pytest

from robolink.errors import (
    ConfigError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.timing import Deadline, SystemClock
from robolink.transport import parse_url
from robolink.transport.serial_port import SerialSettings, open_serial

CLOCK = SystemClock()


def soon(seconds=1.0):
    return Deadline.after(CLOCK, seconds)


@pytest.fixture
def line():
    """An open port and the descriptor at its other end."""
    far, device = os.openpty()
    tty.setraw(device)
    url = parse_url(f"desk+serial://{os.ttyname(device)}")
    port = open_serial(url, SerialSettings(115_200, "N", 1), timeout_s=1.0, clock=CLOCK)
    yield port, far
    port.close()
    os.close(far)
    os.close(device)


def test_bytes_go_out_and_come_in(line):
    port, far = line
    port.send(b"\x01\x04", deadline=soon())
    assert os.read(far, 64) == b"\x01\x04"
    os.write(far, b"\x01\x84\x02")
    assert port.wait_readable(deadline=soon())
    assert port.receive(deadline=soon()) == b"\x01\x84\x02"


def test_what_waits_is_taken_without_waiting(line):
    port, far = line
    assert port.receive_waiting() is None
    os.write(far, b"stale")
    assert port.wait_readable(deadline=soon())
    assert port.receive_waiting() == b"stale"


def test_silence_ends_at_the_deadline(line):
    port, _ = line
    assert not port.wait_readable(deadline=soon(0.0))
    with pytest.raises(TransportTimeoutError) as caught:
        port.receive(deadline=soon(0.0))
    assert caught.value.remedy


def test_a_port_that_was_closed_says_so(line):
    port, _ = line
    port.close()
    port.close()
    assert port.wait_readable(deadline=soon())
    for use in (port.receive_waiting, lambda: port.receive(deadline=soon())):
        with pytest.raises(TransportClosedError):
            use()
    with pytest.raises(TransportClosedError):
        port.send(b"x", deadline=soon())


def test_an_unplugged_adapter_is_broken_and_not_silent(line, monkeypatch):
    port, _ = line

    def unplugged(size):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(port._port, "read", unplugged)
    with pytest.raises(TransportBrokenError, match="Input/output error") as caught:
        port.receive(deadline=soon())
    assert "plugged in" in caught.value.remedy


def test_a_speed_that_the_port_cannot_have_is_refused():
    far, device = os.openpty()
    try:
        url = parse_url(f"desk+serial://{os.ttyname(device)}")
        settings = SerialSettings(-1, "N", 1)
        with pytest.raises(ConfigError, match="cannot be set"):
            open_serial(url, settings, timeout_s=1.0, clock=CLOCK)
    finally:
        os.close(far)
        os.close(device)
