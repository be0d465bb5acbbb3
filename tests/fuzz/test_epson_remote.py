"""EPSON remote control with nearly valid requests and answers."""

import math
import re
from contextlib import suppress

import pytest
from hypothesis import strategies as st
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.in_process.transport import InProcessTransport

from robolink.controller_outcome import Effect
from robolink.controllers import open_epson
from robolink.controllers.epson.line import text_line
from robolink.errors import RemoteProtocolError, RobolinkError
from robolink.journal import memory_journal
from robolink.model import ANY, Signature, ToolOffset
from robolink.protocols import NEED_DATA, Role, spel
from robolink.protocols.epson_text import (
    EndOfStream,
    EpsonTextCodec,
    Reply,
    parse_preferences,
    parse_status,
)
from robolink.transport import parse_url
from tests._rows import each_row
from tests.fuzz._mutating import edited_bytes, fuzzed
from tests.unit.conftest import Client
from tests.unit.test_spel_statements import before, rows

REQUESTS = (
    b"$Login,secret\r\n",
    b"$GetStatus\r\n",
    b'$Execute,"Print TLSet(1)"\r\n',
    b'$Execute,"TLSet 1, XY(1.5, 2, -3, 0)"\r\n',
    b"$GetVariable,gReal(3),2\r\n",
    b'$SetVariable,gText$,"a text"\r\n',
    b"$SetIO,3,1\r\n$GetIOWord,1\r\n",
)
ANSWERS = (
    b"#Login,0\r\n",
    b"#GetStatus,00100000001,0000\r\n",
    b'#Execute," X:   12.500 Y:   -3.250 Z:  -20.000 U:    0.000\r\n"\r\n',
    b"!Execute,99\r\n",
    b'#GetVariable,"a text, with a comma"\r\n#GetIO,1\r\n',
)
PRINTED = (
    " X:  287.500 Y:  103.250 Z: -100.000 U:   45.000 V:    0.000 W:    0.000 /R /0",
    "XY(12.500, -3.250, -20.000, 0.000)",
    "Tool 1: XY( 12.500, -3.250, -20.000, 0.000)\r\nTool 2: XY( 1.000, 2.000, 3.000, 4.000)",
    "WORLD:   X:  287.500 mm  Y:  103.250 mm  Z: -100.000 mm  U:   45.000 deg\r\n"
    "JOINT:   1:   30.000 deg 2:   40.000 deg 3: -100.000 mm  4:   45.000 deg\r\n"
    "PULSE:   1:    10000 pls 2:    20000 pls 3:   -30000 pls 4:    45000 pls",
    "12.5",
    "-1",
)
PARSERS = (
    spel.parse_point,
    spel.parse_tool_listing,
    spel.parse_where,
    spel.parse_number,
    spel.parse_integer,
    spel.parse_boolean,
    parse_preferences,
    lambda text: parse_status(Reply("GetStatus", tuple(text.split(",")))),
)


def events_of(codec, data):
    """Return a codec's events for bytes and the end of the stream, up to its refusal."""
    found = []
    with suppress(RemoteProtocolError):
        codec.receive_data(data)
        codec.receive_data(b"")
        while not isinstance(event := codec.next_event(), EndOfStream):
            assert event is not NEED_DATA
            found.append(event)
    return found


@fuzzed(10, 20_000, data=st.sampled_from(REQUESTS).flatmap(edited_bytes), cut=st.integers(0, 60))
def test_a_device_reads_a_request_or_refuses_it(data, cut):
    whole = events_of(EpsonTextCodec(Role.DEVICE), data)
    codec = EpsonTextCodec(Role.DEVICE)
    with suppress(RemoteProtocolError):
        codec.receive_data(data[:cut])
    assert whole is not None


@fuzzed(10, 20_000, data=st.sampled_from(ANSWERS).flatmap(edited_bytes))
def test_a_host_reads_an_answer_or_refuses_it(data):
    events_of(EpsonTextCodec(Role.HOST), data)


@fuzzed(
    25,
    20_000,
    data=st.sampled_from(PRINTED).map(str.encode).flatmap(edited_bytes),
    parse=st.sampled_from(PARSERS),
)
def test_what_is_printed_is_read_or_refused(data, parse):
    with suppress(RemoteProtocolError):
        found = parse(data.decode("latin-1"))
        if isinstance(found, float):
            assert math.isfinite(found)


class Listener(Client):
    """Accepts any byte."""

    def heard(self):
        return self.link.outgoing().decode("latin-1").removesuffix("\n").removesuffix("\r")


STATEMENTS = tuple(statement.encode() for statement, _ in rows())


@fuzzed(10, 5000, data=st.sampled_from(STATEMENTS).flatmap(edited_bytes))
def test_a_controller_survives_every_statement(data):
    simulator = EpsonSimulator(seed=3)
    client = Listener(simulator)
    assert client.ask("$Login,") == "#Login,0"
    for statement in before():
        client.ask(f'$Execute,"{statement}"')
    client.link.receive(b'$Execute,"' + data + b'"\r\n', simulator.now_ns)
    client.wait(0.1)
    for tool in range(1, 16):
        offset = simulator.machine.tools.get(tool)
        assert offset is None or all(map(math.isfinite, offset.components()))
    if not client.link.closed:
        client.ask("$Abort")
        client.wait(2.0)
        assert client.ask("$GetStatus").startswith("#GetStatus,") or client.link.closed


@fuzzed(10, 5000, data=st.sampled_from(REQUESTS).flatmap(edited_bytes))
def test_a_controller_answers_or_hangs_up_whatever_it_is_asked(data):
    simulator = EpsonSimulator(seed=3)
    client = Listener(simulator)
    client.ask("$Login,")
    client.link.receive(data, simulator.now_ns)
    client.wait(1.0)
    client.link.receive(b"", simulator.now_ns)
    client.wait(0.1)
    second = Listener(simulator)  # and it goes on serving
    assert second.ask("$Login,") == "#Login,0"


class Distorting(InProcessTransport):
    """Alters the controller's output from the nth piece on."""

    def __init__(self, simulator, clock):
        super().__init__(parse_url("epson+sim://fuzz"), simulator, clock, simulator.lock)
        self.edit = lambda data: data

    def _pump(self):
        held = self._arrived
        self._arrived = b""
        super()._pump()
        self._arrived = held + (self.edit(self._arrived) if self._arrived else b"")


OLD, NEW = ToolOffset(12.5, -3.25, -20.0), ToolOffset(12.75, -3.0, -20.5)


@pytest.mark.fault("F07")
@fuzzed(10, 2500, data=st.data(), at=st.integers(0, 7))
def test_the_driver_claims_nothing_that_is_not_so_whatever_is_answered(data, at):
    simulator, clock = EpsonSimulator(seed=3), ManualClock()
    simulator.machine.tools.set(1, OLD)
    link = Distorting(simulator, clock)
    outcomes = memory_journal(link.identity).log(link.identity, signature=Signature())
    count = 0

    def edit(answer):
        nonlocal count
        count += 1
        return data.draw(edited_bytes(answer)) if count == at + 2 else answer

    link.edit = edit
    said = None
    controller = open_epson(text_line(link), outcomes=outcomes, timeout_s=0.5)
    try:
        with suppress(RobolinkError):
            controller.status()
            controller.facts()
            controller.groups[0].pose()
        try:
            controller.tools.write(1, NEW, expected=ANY)
        except RobolinkError as error:
            said = error
    finally:
        link.close()
    held = simulator.machine.tools.get(1)
    written = held is not None and held.components() == pytest.approx(NEW.components(), abs=5e-4)
    if said is None:
        assert written
    elif written:
        assert said.controller_state.effect is not Effect.UNCHANGED
    assert written or held == OLD


LONG = "7" * 5000


@each_row("text", [*PRINTED, "00100000001,4002"])
def test_a_number_of_thousands_of_digits_is_no_number(text):
    """Python refuses to read one, with an error that is not ours."""
    for digits in re.finditer(r"\d+", text):
        longer = text[: digits.start()] + LONG + text[digits.end() :]
        for parse in PARSERS:
            with suppress(RemoteProtocolError):
                parse(longer)


@each_row("answer", ["!Execute,99", "#GetStatus,00100000001,0000", "#GetIO,1"])
def test_an_answer_with_a_number_of_thousands_of_digits_is_refused(answer):
    head, _, _ = answer.rpartition(",")
    events_of(EpsonTextCodec(Role.HOST), f"{head},{LONG}\r\n".encode())
