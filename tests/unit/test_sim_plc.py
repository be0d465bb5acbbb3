"""The simulated PLC answers the requests of real Modbus clients, and survives faulty ones."""

from pathlib import Path

import pytest
from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU
from pymodbus.pdu.bit_message import ReadCoilsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.faults.stream import EXCEPTION_CODES
from robolink_simulators.hosting.modbus_frames import LineFrames
from robolink_simulators.plc import PlcSimulator, device

from robolink.errors import ConfigError
from robolink.register_maps import load_map
from tests._rows import each_row

MAP = Path("examples/plc-maps/commit-bit.toml")


@pytest.fixture
def plc():
    return PlcSimulator(load_map(MAP), unit=1)


def ask(link, pdu, unit=1, now_ns=0):
    framer = FramerSocket(DecodePDU(is_server=False))
    payload = bytes([pdu.function_code]) + pdu.encode()
    link.receive(framer.encode(payload, unit, 7), now_ns)
    frame = link.outgoing()
    assert frame[:2] == b"\x00\x07"
    return framer.decoder.decode(frame[7:])


def test_what_is_written_reads_back(plc):
    link = plc.connect(0)
    ask(link, WriteMultipleRegistersRequest(address=100, registers=[1, 2, 3]))
    ask(link, WriteSingleRegisterRequest(address=103, registers=[4]))
    ask(link, WriteSingleCoilRequest(address=2000, bits=[True]))
    found = ask(link, ReadHoldingRegistersRequest(address=100, count=4))
    assert found.registers == [1, 2, 3, 4]
    assert ask(link, ReadCoilsRequest(address=2000, count=1)).bits[0] is True
    assert plc.writes == ["fc16 100", "fc6 103", "fc5 2000"]


@pytest.mark.parametrize("encoded", ["int16", "uint16", "int32", "uint32"])
def test_a_tool_that_whole_numbers_cannot_hold_is_the_nearest_that_they_can(encoded, tmp_path):
    path, after = tmp_path / "map.toml", 101 if encoded.endswith("16") else 102
    path.write_text(
        'schema = "robolink/plc-map/1"\nname = "narrow"\n'
        f'[numbers]\ntype = "{encoded}"\nword_order = "low_first"\nscale = 1e-6\n'
        f"[[tools]]\nnumber = 1\nx = {{ address = 100 }}\ny = {{ address = {after} }}\n"
        '[commit]\nkind = "none"\nsettle_s = 0.2\n'
    )
    plc = PlcSimulator(load_map(path))
    bits = int(encoded[-2:])
    lowest = 0 if encoded.startswith("u") else -(1 << bits - 1)
    plc.program.set_tool(1, {"x": 1e6, "y": -1e6})
    for _ in "ab":
        stored = plc.truth()["stored"]["1"]
        assert stored["x_mm"] == pytest.approx((lowest + (1 << bits) - 1) * 1e-6)
        assert stored["y_mm"] == pytest.approx(lowest * 1e-6)
        plc.restart()


def test_the_writes_that_are_remembered_are_bounded(plc, monkeypatch):
    monkeypatch.setattr(device, "MOST_WRITES", 3)
    link = plc.connect(0)
    for number in range(20):
        ask(link, WriteSingleRegisterRequest(address=100 + number % 2, registers=[number]))
    assert plc.writes[-3:] == ["fc6 101", "fc6 100", "fc6 101"]
    assert len(plc.writes) <= 6


def test_the_probe_is_there_in_the_order_of_the_map(plc):
    found = ask(plc.connect(0), ReadInputRegistersRequest(address=20, count=2))
    assert found.registers == [0x8794, 0x4145]


@pytest.mark.parametrize(
    ("pdu", "unit", "code"),
    [
        (ReadHoldingRegistersRequest(address=100, count=1), 2, 11),
        (ReadHoldingRegistersRequest(address=60000, count=1), 1, 2),
        (WriteMultipleRegistersRequest(address=60000, registers=[1]), 1, 2),
    ],
)
def test_what_it_does_not_have_is_refused(plc, pdu, unit, code):
    answer = ask(plc.connect(0), pdu, unit)
    assert answer.isError()
    assert answer.exception_code == code
    assert plc.writes == []


def test_an_unknown_function_is_refused(plc):
    link = plc.connect(0)
    link.receive(bytes.fromhex("0007 0000 0003 01 2b 0e"), 0)
    assert link.outgoing()[7:] == bytes.fromhex("ab 01")


@pytest.mark.parametrize("code", EXCEPTION_CODES)
def test_a_request_is_refused_as_planned_and_not_carried_out(plc, code):
    refused = Fault(FaultAction.MODBUS_EXCEPTION, match="fc16 100", code=code)
    plc.faults.add(refused)
    link, write = plc.connect(0), WriteMultipleRegistersRequest(address=100, registers=[1, 2])
    assert ask(link, ReadHoldingRegistersRequest(address=100, count=2)).registers != [1, 2]
    answer = ask(link, write)
    assert (answer.exception_code, plc.writes, plc.faults.fired) == (code, [], [refused])
    assert not ask(link, write).isError()
    assert plc.writes == ["fc16 100"]


@each_row("code", [0, 9, 12])
def test_an_exception_that_there_is_not_cannot_be_planned(code):
    with pytest.raises(ConfigError, match=f"no Modbus exception {code}"):
        Fault(FaultAction.MODBUS_EXCEPTION, code=code)
    with pytest.raises(ConfigError, match=f"no Modbus exception {code}"):
        PlcFault(PlcFaultAction.MODBUS_EXCEPTION, code=code)


def test_a_stream_that_is_no_modbus_ends_the_connection_and_not_the_plc(plc):
    link = plc.connect(0)
    link.receive(bytes(16), 0)
    assert link.closed
    assert ask(plc.connect(0), ReadHoldingRegistersRequest(address=100, count=1)).registers


def test_a_request_in_pieces_is_answered_once_it_is_whole(plc):
    link = plc.connect(0)
    frame = bytes.fromhex("0007 0000 0006 01 03 0064 0001")
    for byte in frame[:-1]:
        link.receive(bytes([byte]), 0)
        assert link.outgoing() == b""
    link.receive(frame[-1:], 0)
    assert len(link.outgoing()) == 11


def test_the_program_answers_after_its_time_and_takes_over_once(plc):
    link = plc.connect(0)
    ask(link, WriteMultipleRegistersRequest(address=100, registers=[0, 0x3F80]))
    before = plc.program.in_force[1]["x"]
    ask(link, WriteSingleCoilRequest(address=2000, bits=[True]))
    assert plc.program.in_force[1]["x"] == before
    due = plc.next_change()
    plc.advance(due)
    assert plc.program.in_force[1]["x"] == 1.0
    ask(link, WriteSingleCoilRequest(address=2000, bits=[True]), now_ns=due)
    plc.advance(due + 10**9)
    assert plc.program.takeovers == 1


def on_line(pdu, unit=1):
    """Return the frame of a request on a serial line."""
    payload = bytes([pdu.function_code]) + pdu.encode()
    return FramerRTU(DecodePDU(is_server=False)).encode(payload, unit, 0)


@pytest.mark.parametrize("pieces", [1, 3, 13])
def test_on_a_serial_line_a_request_may_come_in_pieces(plc, pieces):
    link = plc.connect(0, LineFrames())
    frame = on_line(WriteMultipleRegistersRequest(address=100, registers=[7, 8]))
    step = -(-len(frame) // pieces)
    for start in range(0, len(frame), step):
        assert link.outgoing() == b""
        link.receive(frame[start : start + step], 0)
    assert link.outgoing()[:6] == bytes.fromhex("01 10 0064 0002")
    assert plc.writes == ["fc16 100"]


def test_on_a_serial_line_what_is_damaged_or_for_another_unit_is_not_answered(plc):
    link = plc.connect(0, LineFrames())
    damaged = bytearray(on_line(WriteMultipleRegistersRequest(address=100, registers=[7])))
    damaged[8] ^= 1
    link.receive(bytes(damaged), 0)
    link.receive(on_line(WriteSingleRegisterRequest(address=100, registers=[7]), unit=2), 0)
    link.receive(on_line(WriteSingleRegisterRequest(address=100, registers=[7]), unit=0), 0)
    assert (link.outgoing(), plc.writes) == (b"", [])
    link.receive(on_line(ReadHoldingRegistersRequest(address=100, count=1)), 0)
    assert link.outgoing()[:3] == bytes.fromhex("01 03 02")
    link.receive(on_line(ReadHoldingRegistersRequest(address=60000, count=1)), 0)
    assert link.outgoing()[:3] == bytes.fromhex("01 83 02")


def test_on_a_serial_line_silence_ends_half_a_request(plc):
    link = plc.connect(0, LineFrames())
    frame = on_line(WriteMultipleRegistersRequest(address=100, registers=[7, 8]))
    short_of_its_count = frame[:6] + frame[7:]
    link.receive(short_of_its_count, 0)
    link.receive(on_line(ReadHoldingRegistersRequest(address=100, count=1)), 60_000_000)
    assert link.outgoing()[:3] == bytes.fromhex("01 03 02")
    assert plc.writes == []


def test_a_request_that_is_held_up_takes_effect_at_its_time_within_a_long_step(plc):
    """Not at the next reading: its answer is due a moment after it is served."""
    plc.faults.add(Fault(FaultAction.STALL, 0, "fc5", seconds=2.0))
    link = plc.connect(0)
    ask(link, WriteMultipleRegistersRequest(address=100, registers=[1, 2, 3]))
    framer = FramerSocket(DecodePDU(is_server=False))
    pdu = WriteSingleCoilRequest(address=2000, bits=[True])
    link.receive(framer.encode(bytes([pdu.function_code]) + pdu.encode(), 1, 7), 0)
    plc.advance(1_900_000_000)
    assert plc.program.takeovers == 0
    plc.advance(90_000_000_000)
    assert plc.program.takeovers == 1
