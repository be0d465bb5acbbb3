"""Simulated PLCs behind real Modbus servers, a serial cable and a CAN bus."""

import struct
import time
from contextlib import closing

import canopen
import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.canopen_node import CanopenHost, CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import (
    ModbusHost,
    serve_modbus_rtu,
    serve_modbus_tcp,
)
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

from robolink.controllers import read_device_id
from robolink.errors import (
    ConfigError,
    ConnectError,
    RejectedError,
    TransportBrokenError,
    TransportError,
    TransportTimeoutError,
)
from robolink.protocols.mailbox import (
    Command,
    CommandState,
    Opcode,
    decode_response,
    encode_command,
)
from robolink.transport import open_mailbox_link, open_modbus
from tests.unit._mailbox_client import MailboxClient


def plc(**options):
    return SoftMotionSimulator(options=PlcOptions(mailbox=MailboxOptions(**options)))


@pytest.mark.parametrize(
    "softmotion_sim", ["sim", "modbus-tcp", "modbus-rtu", "can"], indirect=True
)
def test_a_client_commands_the_plc_on_every_way_to_it(softmotion_sim):
    with closing(open_mailbox_link(softmotion_sim.url, timeout_s=2.0)) as link:
        client = MailboxClient(link)
        client.take()
        client.done(Opcode.WRITE_TOOL, 5, pose=(1.5, 0.0, 0.0, 0.0, 0.0, 0.0), name="needle")
        assert client.slot(5).tool[0] == 1.5
        assert client.done(Opcode.SELECT_TOOL, 5).tool_slot == 5
        assert any(link.read_head().ack == client.sequence for _ in range(20))
        client.end_of(client.move(z=-1.0).ack_head)
    assert softmotion_sim.simulator.plc.group.movements_started == 1


@pytest.mark.parametrize(
    "options",
    [
        {"command": 100, "response": 300},
        {"command": 100, "response": 300, "slots": 2000},
        {"command": 700, "registers": "holding"},
    ],
)
def test_the_blocks_stand_where_the_url_says(options):
    with serve_modbus_tcp(plc(**options)) as host:
        assert all(f"{name}={value}" in host.url for name, value in options.items())
        with closing(open_mailbox_link(host.url)) as link:
            client = MailboxClient(link)
            client.take()
            assert client.slot(1).name == "nozzle"
            client.done(Opcode.CLEAR_TOOL, 15)


def test_every_unit_is_answered_on_tcp_and_only_its_own_on_a_serial_line():
    simulator = plc()
    with serve_modbus_tcp(simulator) as tcp, serve_modbus_rtu(simulator, unit=7) as rtu:
        for unit in (0, 1, 255):
            url = tcp.url.replace("softmotion", "plc") + f"?unit={unit}"
            with closing(open_modbus(url)) as client:
                assert client.read_input(0, 1) == (0x0100,)
        assert "unit=7" in rtu.url
        with closing(open_mailbox_link(rtu.url)) as link:
            assert decode_response(link.read_response()).boot_id == 1
        with pytest.raises(ConnectError, match="Unit 8"):
            open_mailbox_link(rtu.url.replace("unit=7", "unit=8"), timeout_s=0.4)


def test_coils_overlay_the_holding_registers_and_discrete_inputs_the_input_registers():
    simulator = plc(command=10)
    with serve_modbus_tcp(simulator) as host:
        with closing(open_modbus(host.url.split("?")[0].replace("softmotion", "plc"))) as client:
            client.write_registers(10, (0x8001,))
            assert client.read_coils(160, 16) == (True, *(False,) * 14, True)
            client.write_coil(161, value=True)
            assert client.read_holding(10, 1) == (0x8003,)
            assert simulator.plc.program.inbox.words[0] == 0x8003
            assert client.read_discrete(0, 16) == (*(False,) * 8, True, *(False,) * 7)
            client.write_registers(9, (5, 6))
            assert client.read_holding(9, 2) == (5, 6)
            with pytest.raises(RejectedError):
                client.read_input(4000, 100)


def test_a_beat_alone_is_one_exchange():
    simulator = plc()
    with serve_modbus_tcp(simulator) as host, closing(open_mailbox_link(host.url)) as link:
        link.beat(0x0105)
        link.read_head()
        assert [text for _, way, text in simulator.log if way == ">"] == ["beat", "read_head"]


def test_the_watchdog_zeroes_what_was_written():
    simulator = plc(watchdog_ms=200)
    with serve_modbus_tcp(simulator) as host:
        with closing(open_modbus(host.url.replace("softmotion", "plc"))) as client:
            client.write_registers(62, (0x0105,))
            assert client.read_holding(62, 1) == (0x0105,)
            client.clock.sleep(0.3)
            assert client.read_holding(62, 1) == (0,)


@pytest.mark.parametrize(
    ("action", "error"),
    [
        (PlcFaultAction.DROP_REPLY, TransportTimeoutError),
        (PlcFaultAction.DISCONNECT, TransportBrokenError),
        (PlcFaultAction.DISCONNECT_BEFORE, TransportBrokenError),
    ],
)
def test_faults_reach_the_wire_of_a_modbus_server(action, error):
    simulator = plc()
    simulator.faults.add(PlcFault(action, match="write_command"))
    with serve_modbus_tcp(simulator) as host:
        with closing(open_mailbox_link(host.url, timeout_s=0.3)) as link:
            with pytest.raises(error):
                link.write_command(encode_command(Command(1, Opcode.OWNERSHIP, owner=7)))
        with closing(open_mailbox_link(host.url)) as link:
            assert len(link.read_response()) == 112


def test_a_delayed_answer_arrives_late():
    simulator = plc()
    simulator.faults.add(PlcFault(PlcFaultAction.DELAY, match="read_slot", seconds=2.0))
    with serve_modbus_tcp(simulator, clock=ScaledClock(10)) as host:
        with closing(open_mailbox_link(host.url)) as link:
            before = link.clock.now_ns()
            link.read_slot(1)
            assert 0.15e9 < link.clock.now_ns() - before < 1.5e9


def test_a_restart_cuts_tcp_and_shows_its_boot_id_on_a_serial_line():
    simulator = plc()
    with serve_modbus_tcp(simulator) as tcp, serve_modbus_rtu(simulator) as rtu:
        with (
            closing(open_mailbox_link(tcp.url)) as cut,
            closing(open_mailbox_link(rtu.url)) as line,
        ):
            assert decode_response(cut.read_response()).boot_id == 1
            line.read_response()
            simulator.panel.restart()
            with pytest.raises(TransportBrokenError):
                cut.read_response()
            assert decode_response(line.read_response()).boot_id == 2
        with closing(open_mailbox_link(tcp.url)) as link:
            assert decode_response(link.read_response()).boot_id == 2


@pytest.mark.fault("F73")
def test_a_port_is_taken_once_and_stays_on_this_machine():
    with serve_modbus_tcp(plc()) as host:
        port = int(host.url.rpartition(":")[2])
        with pytest.raises(ConnectError, match=str(port)):
            serve_modbus_tcp(plc(), port=port)
    with pytest.raises(ConfigError, match="other machines"):
        serve_modbus_tcp(plc(), "0.0.0.0")


@pytest.fixture
def node(request, tmp_path):
    """A node on a virtual bus, and the simulator behind it."""
    simulator = plc(**getattr(request, "param", {}))
    with serve_canopen(simulator, CanPlace("virtual", tmp_path.name)) as host:
        yield host, simulator


@pytest.fixture
def remote(node, tmp_path):
    """canopen's own client of that node."""
    with canopen.Network() as network:
        network.NOTIFIER_CYCLE = 0.02
        network.connect(interface="virtual", channel=tmp_path.name)
        yield network.add_node(5, canopen.ObjectDictionary())


def test_a_copy_stands_still_until_the_next_snapshot(node, remote):
    _, simulator = node
    before = remote.sdo.upload(0x2101, 0)
    simulator.panel.press_estop()
    assert remote.sdo.upload(0x2101, 0) == before
    remote.sdo.download(0x2102, 5, b"\1\0")
    assert remote.sdo.upload(0x2101, 0) != before


@pytest.mark.parametrize("node", [{"snapshot_latched": False}], indirect=True)
def test_an_unlatched_copy_changes_during_its_upload(node, remote):
    _, simulator = node
    simulator.on_reply = lambda _number, _text: simulator.panel.press_estop()
    words = struct.unpack("<112H", remote.sdo.upload(0x2101, 0))
    with pytest.raises(ValueError, match="checksum"):
        decode_response(words)


def test_the_mailbox_is_described_by_its_objects(node, remote):
    assert remote.sdo.upload(0x2102, 1) == b"\x00\x01"
    assert remote.sdo.upload(0x2102, 2) == b"\x01\x00"
    assert struct.unpack("<d", remote.sdo.upload(0x2102, 4)) == (12.3456,)
    assert remote.sdo.upload(0x1017, 0) == b"\x64\x00"
    for index, data in ((0x1017, b"\x10\x00"), (0x2100, b"\0" * 10), (0x2101, b"\0" * 224)):
        with pytest.raises(canopen.SdoAbortedError):
            remote.sdo.download(index, 0, data)


def test_a_command_may_be_written_field_by_field(node, remote):
    _, simulator = node
    command = Command(9, Opcode.OWNERSHIP, operands=(1, 0, 0, 0), owner=5)
    data = struct.pack("<64H", *encode_command(command))
    sizes = [2] * 8 + [8] * 10 + [16, 4] + [2] * 6
    starts = [sum(sizes[:n]) for n in range(len(sizes))]
    for number, (start, size) in enumerate(zip(starts, sizes, strict=True), 1):
        assert simulator.plc.program.jobs.acknowledged is None
        remote.sdo.download(0x2110, number, data[start : start + size])
        assert remote.sdo.upload(0x2110, number) == data[start : start + size]
    assert remote.sdo.upload(0x2100, 0) == data
    time.sleep(0.02)
    remote.sdo.download(0x2102, 5, b"\1\0")
    response = decode_response(struct.unpack("<112H", remote.sdo.upload(0x2101, 0)))
    assert (response.ack_head, response.state) == (9, CommandState.DONE)


def test_a_start_of_the_plc_is_announced_on_the_bus(node):
    host, simulator = node
    with closing(open_mailbox_link(host.url)) as link:
        link.read_head()
        simulator.panel.restart()
        with pytest.raises(TransportBrokenError, match="restarted"):
            for _ in range(50):
                link.read_head()
    with closing(open_mailbox_link(host.url)) as link:
        assert decode_response(link.read_response()).boot_id == 2


def test_an_answer_may_be_lost_on_the_bus(node):
    host, simulator = node
    simulator.faults.add(PlcFault(PlcFaultAction.DROP_REPLY, match="write_command"))
    with closing(open_mailbox_link(host.url, timeout_s=0.3)) as link:
        with pytest.raises(TransportTimeoutError):
            link.write_command(encode_command(Command(1, Opcode.OWNERSHIP, owner=7)))
    assert simulator.plc.program.inbox.words[0] == 1


def test_several_hosts_serve_one_plc(tmp_path):
    simulator = plc()
    clock = ScaledClock()
    with (
        serve_modbus_tcp(simulator, clock=clock) as tcp,
        serve_canopen(simulator, CanPlace("virtual", tmp_path.name), clock=clock) as can,
        closing(open_mailbox_link(tcp.url)) as one,
        closing(open_mailbox_link(can.url)) as other,
    ):
        assert simulator.url == tcp.url
        MailboxClient(one).take()
        assert decode_response(other.read_response()).answer.holder == 0xC0FFEE


def test_a_can_interface_that_is_not_there_is_named():
    with pytest.raises(ConfigError, match="tincan"):
        serve_canopen(plc(), CanPlace("tincan", "x"))


def test_a_closed_host_answers_no_more(tmp_path):
    simulator = plc()
    hosts: list[ModbusHost | CanopenHost] = [
        serve_modbus_tcp(simulator),
        serve_modbus_rtu(simulator),
        serve_canopen(simulator, CanPlace("virtual", tmp_path.name)),
    ]
    for host in hosts:
        host.close()
        host.close()
        with pytest.raises(TransportError):
            open_mailbox_link(host.url, timeout_s=0.2)


def test_one_plc_has_one_number_on_all_of_its_buses():
    simulator = plc()
    place = CanPlace("virtual", "one-number")
    with (
        serve_modbus_tcp(simulator) as tcp,
        serve_modbus_rtu(simulator) as rtu,
        serve_canopen(simulator, place) as can,
    ):
        found = []
        for host in (tcp, rtu, can):
            with closing(open_mailbox_link(host.url, timeout_s=2.0)) as link:
                found.append(read_device_id(link))
    assert found == [simulator.plc.memory.device_id] * 3


def test_a_plc_whose_program_has_no_number_says_so_on_all_of_its_buses():
    simulator = plc(identified=False)
    with (
        serve_modbus_tcp(simulator) as tcp,
        serve_canopen(simulator, CanPlace("virtual", "no-number")) as can,
    ):
        for host in (tcp, can):
            with closing(open_mailbox_link(host.url, timeout_s=2.0)) as link:
                assert read_device_id(link) is None
