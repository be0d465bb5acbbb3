"""The URLs of a mailbox, and a serial port as a transport."""

import os
import subprocess
import sys
import tty
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from types import SimpleNamespace

import pytest

from robolink.errors import (
    ConfigError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.protocols import mailbox
from robolink.timing import Deadline, SystemClock
from robolink.transport import (
    TRANSPORTS_GROUP,
    _mailbox_link,
    open_mailbox_link,
    open_modbus,
    parse_url,
)
from robolink.transport._url import UrlOptions
from robolink.transport.modbus.mailbox import _take_places
from robolink.transport.serial_port import SerialSettings, open_serial, serial_device
from tests._rows import each_row

# The allowed URLs of a mailbox, and the cost of importing the package.

TCP = "softmotion+modbus-tcp://192.0.2.1:502"
RTU = "softmotion+modbus-rtu:///dev/no-such-port"
CAN = "softmotion+can://desk"


@each_row(
    ("url", "named"),
    [
        (f"{TCP}?baud=9600", "baud"),
        (f"{TCP}?unit=256", "unit"),
        (f"{TCP}?unit=\u0661", "unit"),
        (f"{TCP}?registers=coils", "registers"),
        (f"{TCP}?response=70000", "response"),
        ("softmotion+modbus-tcp://", "names no host"),
        (f"{TCP}/path", "names no host"),
        (f"{RTU}?unit=0", "unit"),
        (f"{RTU}?unit=248", "unit"),
        (f"{RTU}?parity=mark", "parity"),
        (f"{RTU}?echo=maybe", "echo"),
        (f"{RTU}?baud=0", "baud"),
        ("softmotion+modbus-rtu://", "names no serial port"),
        ("softmotion+modbus-rtu://com3:5000", "names no serial port"),
        ("softmotion+can://can0", "node is missing"),
        ("softmotion+can://can0?node=128", "node"),
        ("softmotion+can://?node=5", "names no CAN channel"),
        (f"{CAN}?node=5&interface=pigeon", "pigeon"),
        (f"{CAN}?node=5&interface=virtual&start=perhaps", "start"),
        (f"{CAN}?node=5&interface=virtual&unit=1", "unit"),
        ("softmotion+pigeon://loft", "pigeon"),
    ],
)
def test_a_url_that_cannot_be_meant_is_refused_with_a_remedy(url, named):
    with pytest.raises(ConfigError, match=named) as caught:
        open_mailbox_link(url)
    assert caught.value.remedy


def test_an_unknown_option_is_answered_with_those_that_there_are():
    with pytest.raises(ConfigError) as caught:
        open_mailbox_link(f"{TCP}?node=5")
    for known in ("unit", "command", "response", "slots", "registers"):
        assert known in caught.value.remedy


def test_a_client_for_bare_registers_knows_no_mailbox():
    with pytest.raises(ConfigError, match="command"):
        open_modbus("plc+modbus-tcp://192.0.2.1?command=10")


def test_a_simulated_mailbox_is_found_by_the_name_of_its_scheme(monkeypatch):
    class DeskEntryPoint(EntryPoint):
        def load(self):
            return lambda url, *, timeout_s, clock: SimpleNamespace(
                identity=url.host, place=f"{timeout_s} {clock}", clock=SystemClock()
            )

    group = EntryPoints([DeskEntryPoint("softmotion+desk", "desk:opener", TRANSPORTS_GROUP)])
    monkeypatch.setattr(metadata, "entry_points", lambda **by: group.select(**by))
    opened = open_mailbox_link("softmotion+desk://cell-b", timeout_s=1.5)
    assert (opened.identity, opened.place) == ("cell-b", "1.5 None")


def places(query):
    return _take_places(UrlOptions(parse_url(f"{TCP}?{query}" if query else TCP)))


def test_the_slots_follow_the_response_unless_they_are_elsewhere():
    assert (places("").command, places("").response, places("").slots) == (0, 0, 112)
    assert places("response=200").slots == 312
    assert places("response=200&slots=1000").slots == 1000


@each_row(
    ("query", "sentence"),
    [
        ("slots=111", r"30112 \(address 111\)"),
        ("registers=holding", "overlap"),
        ("registers=holding&response=64&slots=160", "response and slots"),
        ("registers=holding&command=700&response=64", "slots and command"),
    ],
)
def test_blocks_that_overlap_are_refused(query, sentence):
    with pytest.raises(ConfigError, match=sentence) as caught:
        places(query)
    assert "Give " in caught.value.remedy


def test_blocks_of_one_table_may_stand_side_by_side():
    assert places("registers=holding&response=64&slots=176").command == 0


@pytest.mark.parametrize(
    ("url", "device"),
    [(RTU, "/dev/no-such-port"), ("softmotion+modbus-rtu://COM3", "COM3")],
)
def test_a_serial_port_is_named_the_way_of_its_system(url, device):
    assert serial_device(parse_url(url)) == device


@each_row(("parity", "stop_bits", "bits"), [("N", 1, 10), ("E", 1, 11), ("N", 2, 11)])
def test_a_character_takes_as_long_as_its_bits(parity, stop_bits, bits):
    assert SerialSettings(9600, parity, stop_bits).character_s == pytest.approx(bits / 9600)


def test_the_links_know_the_sizes_and_places_of_the_layout():
    assert _mailbox_link.COMMAND_WORDS == mailbox.COMMAND_WORDS
    assert _mailbox_link.RESPONSE_WORDS == mailbox.RESPONSE_WORDS
    assert _mailbox_link.SLOT_WORDS == mailbox.SLOT_WORDS
    assert _mailbox_link.DEVICE_WORDS == mailbox.DEVICE_WORDS
    assert _mailbox_link.RESPONSE_WORDS + 15 * _mailbox_link.SLOT_WORDS == mailbox.DEVICE_START
    assert list(range(1, _mailbox_link.SLOTS + 1)) == list(mailbox.SLOTS)
    assert mailbox.COMMAND.at("client_heartbeat").start == _mailbox_link.HEARTBEAT_WORD
    head = ("ack_head", "state", "error_class", "group_state", "plc_heartbeat")
    assert tuple(mailbox.RESPONSE.at(name).start for name in head) == _mailbox_link.HEAD_PLACES


@pytest.mark.parametrize("module", ["robolink.transport", "robolink"])
def test_nothing_heavy_is_imported_before_such_a_url_is_opened(module):
    program = (
        f"import sys, {module}; "
        "print(sorted({'pymodbus', 'can', 'canopen', 'serial', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=30
    )
    assert done.stdout.strip() == "[]"


# A serial port as a transport, on a pseudo terminal.

CLOCK = SystemClock()


def soon(seconds=1.0):
    return Deadline.after(CLOCK, seconds)


@pytest.fixture
def line():
    """An open port and the descriptor of its other end."""
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
