"""``robolink robot release``: what a person agreed to, and nothing else."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.stopping import clear_note, find_note
from robolink.transport import far_end_of

JOG = ["robot", "jog", "z+1", "--yes"]


@pytest.fixture
def plc(robolink_state):
    """A stopped PLC: the simulator and its URL."""
    simulator = SoftMotionSimulator(seed=3)
    group = simulator.plc.group
    with serve_modbus_tcp(simulator, clock=ScaledClock(20)) as host:
        assert main.run(["-c", host.url, "stop"]) == 0
        assert group.state is SmcGroupState.STOPPING
        yield simulator, host.url


def robolink(url, *words):
    return main.run(["-c", url, *words])


def noted(url):
    return find_note(far_end_of(url)) is not None


def test_it_releases_the_axis_group_of_a_plc_and_resets_nothing(plc, capsys):
    simulator, url = plc
    assert robolink(url, *JOG) == 5
    capsys.readouterr()
    assert robolink(url, "--json", "robot", "release", "--yes") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["released"], document["hold_released"]) == (True, True)
    assert simulator.plc.group.state is SmcGroupState.STANDBY
    assert not noted(url)
    assert robolink(url, *JOG) == 0


def test_an_error_stays_and_is_told(plc, capsys):
    simulator, url = plc
    with simulator.lock:
        simulator.plc.group.fail_axis(0)
    assert robolink(url, "robot", "release", "--yes") == 0
    assert "state is: fault" in capsys.readouterr().out
    assert simulator.plc.group.state is SmcGroupState.ERROR_STOP
    assert robolink(url, *JOG) == 5


def test_a_stop_from_another_computer_is_released_too(plc, capsys):
    """It left no note here: the PLC alone tells of it."""
    simulator, url = plc
    clear_note(far_end_of(url))
    assert robolink(url, *JOG) == 5
    assert "robolink robot release" in capsys.readouterr().err
    assert robolink(url, "robot", "release", "--yes") == 0
    assert "A stop holds the axis group" in capsys.readouterr().err
    assert simulator.plc.group.state is SmcGroupState.STANDBY
    assert robolink(url, "robot", "release", "--yes") == 0
    assert "nothing to release" in capsys.readouterr().out


def test_a_dry_run_and_a_no_release_nothing(plc, capsys, monkeypatch):
    simulator, url = plc
    assert robolink(url, "robot", "release", "--dry-run") == 0
    assert "stop" in capsys.readouterr().out.lower()
    monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.prompts.questions.asked", lambda _question: False)
    assert robolink(url, "robot", "release") == 9
    assert simulator.plc.group.state is SmcGroupState.STOPPING
    assert noted(url)


def test_a_plc_that_is_not_reached_releases_nothing(plc, capsys):
    _, url = plc
    gone = url.rpartition(":")[0] + ":1"
    assert robolink(gone, "robot", "release", "--yes", "--timeout", "0.5") == 3
    assert noted(url)


def stops_again(monkeypatch, url):
    """Stop the robot once more while the person is asked, and let the person say yes."""

    def asked(_question):
        assert robolink(url, "stop", "--operator", "anna") == 0
        return True

    monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.prompts.questions.asked", asked)


def test_a_yes_to_one_stop_does_not_release_the_next(robolink_state, monkeypatch, capsys):
    with serve_tcp(EpsonSimulator(seed=4), clock=ScaledClock(20)) as host:
        assert robolink(host.url, "stop", "--operator", "mei") == 0
        stops_again(monkeypatch, host.url)
        assert robolink(host.url, "robot", "release") == 10
        assert "anna" in capsys.readouterr().err
        assert noted(host.url)


def test_nothing_is_sent_to_an_epson_controller(robolink_state):
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator, clock=ScaledClock(20)) as host:
        assert robolink(host.url, "stop") == 0
        before = len(simulator.log)
        assert robolink(host.url, "robot", "release", "--dry-run") == 0
        assert noted(host.url)
        assert robolink(host.url, "robot", "release", "--yes") == 0
        assert len(simulator.log) == before
        assert not noted(host.url)
