"""``robolink stop`` beside a robolink that has locked the controller, or was killed then."""

import time

import pytest
from robolink_cli import entry, main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.stopping import holders_of
from robolink.transport import far_end_of
from tests._patience import PATIENCE_S
from tests.faults._client_process import ClientProcess


@pytest.fixture
def epson():
    simulator = EpsonSimulator(seed=4)
    simulator.machine.switch_motors(True)
    with serve_tcp(simulator, clock=ScaledClock(1.0)) as host:
        yield simulator, host.url


@pytest.fixture
def plc():
    simulator = SoftMotionSimulator(seed=4)
    with serve_modbus_tcp(simulator, clock=ScaledClock(1.0)) as host:
        yield simulator, host.url


@pytest.fixture
def beside(tmp_path):
    """Start a command in a separate process."""

    def started(*arguments):
        return ClientProcess(
            arguments, environment={"ROBOLINK_STATE_DIR": str(tmp_path / "state")}, folder=tmp_path
        )

    return started


def await_that(condition, process):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, process.err
        time.sleep(0.005)


def test_a_second_terminal_stops_through_the_one_that_is_logged_in(epson, beside, capsys):
    simulator, url = epson
    began_mm = simulator.machine.arm.flange().x_mm
    process = beside("-c", url, "jog", "x-5", "--speed", "1", "--yes")
    await_that(lambda: simulator.machine.arm.moving, process)
    assert entry.run(["-c", url.replace("127.0.0.1", "localhost"), "stop"]) == 0
    assert not simulator.machine.arm.moving
    assert simulator.machine.arm.flange().x_mm > began_mm - 3
    shown = capsys.readouterr().out
    assert "has stopped" in shown
    assert "jog" in shown  # who had it, and for what
    assert process.exit_code() == 10
    assert "Stopped from another terminal by" in process.err
    assert list(holders_of(far_end_of(url))) == []
    assert main.run(["-c", url, "jog", "x+1", "--yes"]) == 10  # the note


def test_a_second_terminal_stops_a_plc_itself(plc, beside, capsys):
    simulator, url = plc
    group = simulator.plc.group
    began_mm = group.flange().shift_mm[0]
    process = beside("-c", url, "jog", "x-5", "--speed", "1", "--yes")
    # A client that has not seen its movement acknowledged knows no more than that it may move.
    await_that(lambda: group.flange().shift_mm[0] < began_mm - 0.5, process)
    assert entry.run(["-c", url.replace("127.0.0.1", "localhost"), "stop"]) == 0
    assert "has stopped" in capsys.readouterr().out
    assert process.exit_code() == 10
    assert group.movements_started == 1
    jog = ["-c", url, "jog", "x+1", "--yes"]
    assert main.run(jog) == 5  # the PLC holds it
    assert group.movements_started == 1
    assert main.run(["-c", url, "release", "--yes"]) == 0
    assert main.run(jog) == 0


@pytest.mark.fault("F23")
def test_a_movement_left_by_a_killed_jog_is_stopped(epson, beside, capsys):
    simulator, url = epson
    process = beside("-c", url, "jog", "x-5", "--speed", "1", "--yes")
    await_that(lambda: simulator.machine.arm.moving, process)
    process.kill()
    assert simulator.machine.arm.moving
    assert entry.run(["-c", url, "stop"]) == 0
    assert not simulator.machine.arm.moving
    assert "has stopped" in capsys.readouterr().out
    # The killed process's leftovers are removed.
    assert list(holders_of(far_end_of(url))) == []
