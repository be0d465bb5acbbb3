"""A stop belongs to the controller, not to the address by which it came."""

import json
from contextlib import ExitStack

import pytest
from robolink_cli import entry, main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.stopping import StopListener, clear_note, find_note, leave_note
from robolink.transport import far_end_of
from tests.faults._client_process import ClientProcess
from tests.faults._second_address import SecondAddress
from tests.faults.test_stop_beside import await_that


@pytest.fixture
def beside(tmp_path):
    """Start a command in a separate process."""

    def started(*arguments):
        return ClientProcess(
            arguments, environment={"ROBOLINK_STATE_DIR": str(tmp_path / "state")}, folder=tmp_path
        )

    return started


@pytest.fixture
def plc():
    """A simulated PLC and its addresses: by number, at a second address, on a serial line."""
    simulator = SoftMotionSimulator(seed=4)
    with ExitStack() as stack:
        tcp = stack.enter_context(serve_modbus_tcp(simulator, clock=ScaledClock(1.0))).url
        rtu = stack.enter_context(serve_modbus_rtu(simulator, clock=ScaledClock(1.0))).url
        other = stack.enter_context(SecondAddress(tcp)).url
        yield simulator, {"number": tcp, "other": other, "line": rtu}


@pytest.fixture
def epson():
    simulator = EpsonSimulator(seed=4)
    simulator.machine.switch_motors(True)
    with (
        serve_tcp(simulator, clock=ScaledClock(1.0)) as host,
        SecondAddress(host.url) as second,
    ):
        yield simulator, host.url, second.url


def let_go(url):
    """Let the PLC move again and leave the note, as somebody at the machine itself does."""
    with robolink.connect(url) as controller:
        controller.reset_fault()


@pytest.mark.parametrize(
    ("stopped", "jogged"), [("line", "number"), ("number", "line"), ("other", "number")]
)
def test_a_plc_that_was_stopped_on_one_way_is_noted_on_each(plc, capsys, stopped, jogged):
    simulator, ways = plc
    assert entry.run(["-c", ways[stopped], "--operator", "anna", "stop"]) == 0
    let_go(ways[jogged])
    started = simulator.plc.group.movements_started
    jog = ["jog", "x+1", "--yes", "-c"]
    capsys.readouterr()
    for url in ways.values():
        assert main.run([*jog, url]) == 10
        assert "anna (process" in capsys.readouterr().err
    assert simulator.plc.group.movements_started == started
    assert main.run(["-c", ways[jogged], "reset", "--yes"]) == 0
    for url in ways.values():
        assert main.run([*jog, url]) == 0


def test_a_release_knows_the_controller_from_the_last_connection(plc, capsys):
    _, ways = plc
    assert main.run(["-c", ways["line"], "status"]) == 0
    assert entry.run(["-c", ways["number"], "stop"]) == 0
    capsys.readouterr()
    assert main.run(["-c", ways["line"], "release", "--yes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["released"] is True
    let_go(ways["number"])
    assert main.run(["jog", "x+1", "--yes", "-c", ways["number"]]) == 0


def test_an_epson_controller_that_was_stopped_at_one_address_is_noted_at_the_other(epson, capsys):
    simulator, url, second = epson
    assert entry.run(["-c", second, "--operator", "anna", "stop"]) == 0
    assert main.run(["-c", url, "jog", "x+1", "--yes"]) == 10
    assert "anna (process" in capsys.readouterr().err
    assert simulator.machine.arm.moves_started == 0
    assert main.run(["-c", url, "reset", "--yes"]) == 0
    assert find_note(far_end_of(second)) is None


def test_whoever_has_a_plc_on_the_network_hears_of_a_stop_on_its_line(plc):
    _, ways = plc
    heard: list[str] = []
    with (
        robolink.connect(ways["number"]) as controller,
        StopListener(
            controller, ways["number"], name=controller.outcomes.identity, heard=heard.append
        ),
    ):
        assert entry.run(["-c", ways["line"], "--operator", "anna", "stop"]) == 0
        assert controller.latch.closed
    assert [who.startswith("anna") for who in heard] == [True]


def test_a_command_that_moves_a_plc_is_stopped_on_its_line(plc, beside):
    simulator, ways = plc
    process = beside("-c", ways["number"], "jog", "x-5", "--speed", "1", "--yes")
    await_that(lambda: simulator.plc.group.movements_started > 0, process)
    assert entry.run(["-c", ways["line"], "stop"]) == 0
    assert process.exit_code() == 10


def test_whoever_has_an_epson_controller_stops_it_for_one_at_its_other_address(
    epson, beside, capsys
):
    simulator, url, second = epson
    assert main.run(["-c", second, "status"]) == 0  # it was met there before
    process = beside("-c", url, "jog", "x-5", "--speed", "1", "--yes")
    await_that(lambda: simulator.machine.arm.moving, process)
    assert entry.run(["-c", second, "--timeout", "0.5", "stop"]) == 0
    assert not simulator.machine.arm.moving
    assert "jog" in capsys.readouterr().out  # who had it, and for what
    assert process.exit_code() == 10


def test_another_controller_at_the_same_address_was_not_stopped(capsys):
    first, other = EpsonSimulator(seed=4), EpsonSimulator(seed=5)
    with serve_tcp(first) as host:
        url = host.url
        port = int(url.rpartition(":")[2])
        assert entry.run(["-c", url, "stop"]) == 0
    other.machine.switch_motors(True)
    with serve_tcp(other, port=port):
        capsys.readouterr()
        assert main.run(["-c", url, "jog", "x+1", "--yes"]) == 0, capsys.readouterr()
        # The reset at this address removes only the note about this controller.
        assert main.run(["-c", url, "reset", "--yes"]) == 0
    first.machine.switch_motors(True)
    with serve_tcp(first, port=port):
        assert main.run(["-c", url, "jog", "x+1", "--yes"]) == 10


def test_where_nobody_could_ask_a_note_counts_in_doubt():
    keys, name = frozenset({"epson 192.168.0.1 5000"}), "epson:1/2"
    leave_note(keys, "epson+tcp://192.168.0.1:5000", "anna", confirmed=False, last_known=name)
    for found in (find_note(keys), find_note(keys, "epson:3/4"), find_note(frozenset(), name)):
        assert found is not None
        assert found.who == "anna"
    assert find_note(frozenset(), "epson:3/4") is None
    clear_note(frozenset(), name)
    assert find_note(keys) is None
