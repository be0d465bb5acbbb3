"""Login and logout, states that forbid a command, and the meaning of a closed link."""

import pytest
from robolink_simulators.epson.condition import Mode
from robolink_simulators.epson.device import EpsonSimulator

from robolink import ANY, Secret, ToolOffset
from robolink.errors import (
    ConnectError,
    LoginRefusedError,
    LoginUnansweredError,
    NotReadyError,
    TransportClosedError,
)
from robolink.model import ControllerState

CANARY = "k4nar1envogel"


@pytest.mark.on_every_link
def test_status_after_the_login(cell):
    with cell.connect() as controller:
        status = controller.status()
        assert status.remote
        assert status.state is ControllerState.READY


def test_a_closed_controller_says_so(cell):
    with cell.connect() as controller:
        pass
    with pytest.raises(TransportClosedError, match="Connect again"):
        controller.status()


def test_the_right_password_opens(serve):
    with serve(EpsonSimulator(password=Secret(CANARY))) as cell:
        with cell.connect(password=CANARY) as controller:
            assert controller.status().ready


@pytest.mark.on_every_link
@pytest.mark.fault("F16")
@pytest.mark.parametrize("password", ["canary-wrong", None])
@pytest.mark.fault("F71")
def test_f16_a_wrong_password_is_tried_once_and_shown_nowhere(serve, password):
    simulator = EpsonSimulator(password=Secret(CANARY))
    with serve(simulator) as cell, pytest.raises(LoginRefusedError) as caught:
        cell.connect(password=password)
    assert caught.value.code == 13
    logins = [text for _, direction, text in simulator.log if "ogin" in text and "$" in text]
    assert len(logins) == 1
    shown = repr(caught.value) + str(caught.value) + repr(list(simulator.log))
    assert "canary-wrong" not in shown
    assert CANARY not in shown


@pytest.mark.fault("F71")
@pytest.mark.remote_ethernet
def test_the_login_frame_is_in_no_trace(serve):
    lines = []
    with serve(EpsonSimulator(password=Secret(CANARY))) as cell:
        with cell.connect(password=CANARY, trace=lambda *line: lines.append(line)) as controller:
            controller.status()
    assert any(b"GetStatus" in data for _, _, data in lines)
    assert CANARY.encode() not in b"".join(data for _, _, data in lines)


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("habit", ["ignored", "closed"])
def test_a_second_client_is_told_that_another_one_is_logged_in(serve, options, habit):
    with serve(EpsonSimulator(options=options(second_client=habit))) as cell:
        with cell.connect() as first:
            with pytest.raises(LoginUnansweredError, match="Only one client"):
                cell.connect(timeout_s=0.3)
            assert first.status().ready


def test_a_closed_port_is_not_reached():
    import robolink

    with pytest.raises(ConnectError, match="127"):
        robolink.connect("epson+tcp://127.0.0.1:1", timeout_s=1)


STATES = {
    "teach": ("teach", "Teach"),
    "press_estop": ("emergency_stop", "emergency stop"),
    "open_guard": ("guard_open", "guard"),
    "start_production": ("running", "program is running"),
    "raise_serious_error": ("serious_fault", "off and on"),
    "monitoring": ("not_remote", "Remote Ethernet"),
}


def bring_about(simulator, state):
    panel = simulator.panel
    acts = {
        "teach": lambda: panel.set_mode(Mode.TEACH),
        "monitoring": lambda: panel.set_monitoring_only(True),
    }
    with simulator.lock:
        (acts.get(state) or getattr(panel, state))()


@pytest.mark.fault("F17", "F20")
@pytest.mark.parametrize("state", STATES)
def test_f17_a_state_that_forbids_a_write_is_named_before_anything_is_written(serve, state):
    simulator = EpsonSimulator(seed=3)
    reason, words = STATES[state]
    with serve(simulator) as cell, cell.connect() as controller:
        bring_about(simulator, state)
        written = simulator.machine.flash_writes
        with pytest.raises(NotReadyError) as caught:
            controller.tools.write(1, ToolOffset(1), expected=ANY)
        assert simulator.machine.flash_writes == written
        requests = [text for _, _, text in simulator.log if "Execute" in text]
        assert not requests
    assert caught.value.reason == reason
    assert words.lower() in str(caught.value).lower()


def test_status_is_always_readable(serve):
    for state in STATES:
        simulator = EpsonSimulator(seed=3)
        with serve(simulator) as cell, cell.connect() as controller:
            bring_about(simulator, state)
            assert controller.status().state is not ControllerState.READY


def test_no_logout_while_a_task_runs(serve):
    simulator = EpsonSimulator(seed=3)
    with serve(simulator) as cell:
        with cell.connect():
            simulator.panel.start_production()
        assert not [text for _, _, text in simulator.log if "ogout" in text]
        assert not simulator.condition.error


def test_logout_when_nothing_runs(serve):
    simulator = EpsonSimulator(seed=3)
    with serve(simulator) as cell:
        with cell.connect():
            pass
        assert [text for _, _, text in simulator.log if "$Logout" in text]


def test_a_reset_is_never_sent_unasked(serve):
    simulator = EpsonSimulator(seed=3)
    with serve(simulator) as cell, cell.connect() as controller:
        simulator.panel.raise_error(4002)
        with pytest.raises(NotReadyError, match="4002"):
            controller.tools.read(1)
        assert not [text for _, _, text in simulator.log if "$Reset" in text]
        controller.reset_fault()
        assert controller.status().ready
