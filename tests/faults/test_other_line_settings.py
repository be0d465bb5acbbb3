"""Two ends of a serial line with different baud rates or parities: row F54.

A pseudo terminal carries bytes at no rate. So each piece passes through two UARTs that are computed
bit by bit, both ways, and the other end gets the bytes that it would have sampled.
"""

import pytest
from robolink_simulators.epson import EpsonSimulator

from robolink.errors import ConnectError, RemoteProtocolError
from tests.faults._uart import UartSettings, heard
from tests.faults.test_epson_serial_faults import line_to as epson_line_to
from tests.faults.test_epson_serial_faults import refused
from tests.faults.test_failing_field_buses import line_to, opened
from tests.unit._scripted_modbus import rtu, words

OURS = UartSettings(9600)
OTHERS = {
    "half the rate": UartSettings(4800),
    "twice the rate": UartSettings(19200),
    "twelve times the rate": UartSettings(115200),
    "even parity": UartSettings(9600, "E"),
    "odd parity": UartSettings(9600, "O"),
}


@pytest.mark.parametrize("theirs", [OURS, UartSettings(9600, "E"), UartSettings(115200, "O")])
def test_alike_settings_carry_each_byte_as_it_is(theirs):
    every = bytes(range(256))
    assert heard(every, sent=theirs, by=theirs) == every


def test_a_rate_that_is_three_percent_off_is_near_enough():
    every = bytes(range(256))
    assert heard(every, sent=UartSettings(9600), by=UartSettings(9888)) == every


@pytest.mark.fault("F54")
@pytest.mark.parametrize(
    "understood", [False, pytest.param(True, marks=pytest.mark.soak)], ids=["noise", "understood"]
)
@pytest.mark.parametrize("theirs", OTHERS.values(), ids=OTHERS)
def test_f54_an_epson_controller_at_other_settings_is_named(theirs, understood):
    """It does not understand what it receives; and its answer would not be accepted."""
    simulator = EpsonSimulator(seed=3)
    far = simulator.connect_serial(0)

    def answer(piece: bytes) -> bytes:
        far.receive(piece if understood else heard(piece, sent=OURS, by=theirs), 0)
        return heard(far.outgoing(), sent=theirs, by=OURS)

    with epson_line_to(answer) as (url, pieces):
        refused(url)
    assert len(pieces) <= 8


@pytest.mark.fault("F54")
@pytest.mark.parametrize("theirs", OTHERS.values(), ids=OTHERS)
def test_f54_a_plc_at_other_settings_is_named_and_nothing_is_read_from_it(theirs):
    noise = heard(rtu(words(1, 2, 3)), sent=theirs, by=OURS)
    with line_to(lambda _n: noise) as (device, asked, _far):
        with pytest.raises((ConnectError, RemoteProtocolError)) as caught:
            opened(device, 0.5)
    assert len(asked) <= 3
    assert caught.value.remedy
