"""A stop from outside stops any controller, whatever is moving it."""

import socket
from dataclasses import replace
from typing import Any

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction

from robolink import ANY, Secret, ToolOffset
from robolink.controllers import stop_now
from robolink.errors import (
    ConnectError,
    LoginRefusedError,
    LoginUnansweredError,
    NotReadyError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportTimeoutError,
)
from robolink.model import ControllerState, MotionProfile, Path, WorkBox
from tests.contract._softmotion_cell import BACKENDS, LINKS, SLOW, above, few_links
from tests.contract._softmotion_cell import served as served_plc

CREEPING = MotionProfile(Path.STRAIGHT, 5, 1.0)
ANYWHERE = WorkBox()

HABITS: tuple[dict[str, Any], ...] = (
    {},
    {"abort_reply_first": False},
    {"flags_during_execute": "ready"},
    {"status_flags": 10},
    {"execute_on_disconnect": "stops"},
    {"rc_plus": 5, "status_flags": 10},
)


HABITS_ON_LINKS = [
    pytest.param(
        link,
        habits,
        id=f"{link}-{habits}",
        marks=pytest.mark.soak if habits and link != "sim" else (),
    )
    for habits in HABITS
    for link in ("sim", "tcp", "pty")
]
"""Each habit is one of the controller, whatever link it is reached by."""


def left_moving(cell, **options):
    """Begin a slow movement of 30 mm and drop its client, like a killed process."""
    controller = cell.connect(**options)
    controller.motors(True)
    group = controller.groups[0]
    here = group.pose()
    group.move_to(replace(here, z_mm=here.z_mm + 30), CREEPING, box=ANYWHERE)
    controller._link.session.close()


@pytest.mark.on_every_link
@pytest.mark.parametrize(("serve", "habits"), HABITS_ON_LINKS, indirect=["serve"])
def test_a_movement_whose_client_died_is_brought_to_rest(serve, habits):
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(**habits))
    with serve(simulator) as cell:
        left_moving(cell)
        begun = simulator.machine.arm.flange().z_mm
        assert stop_now(cell.url).state is ControllerState.READY
        assert not simulator.machine.arm.moving
        # It was under way, and far from its end, when it was stopped.
        assert simulator.machine.arm.flange().z_mm < begun + 15
        with cell.connect() as controller:  # nobody is left logged in
            assert controller.status().state is ControllerState.READY


@pytest.mark.parametrize("action", [FaultAction.DROP_REPLY, FaultAction.DISCONNECT])
@pytest.mark.parametrize("request_", ["Abort", "Stop", "GetStatus"])
@pytest.mark.fault("F76")
def test_f76_a_lost_answer_is_no_reason_to_leave_it_moving(serve, request_, action):
    simulator = EpsonSimulator(seed=7)
    with serve(simulator) as cell:
        left_moving(cell)
        simulator.faults.add(Fault(action, match=request_))
        assert stop_now(cell.url, timeout_s=0.3).state is ControllerState.READY
        assert not simulator.machine.arm.moving
        assert simulator.faults.pending == ()


@pytest.mark.fault("F01")
def test_the_late_end_of_an_execute_does_not_disturb_a_stop(serve):
    simulator = EpsonSimulator(seed=7)
    with serve(simulator) as cell:
        left_moving(cell)
        simulator.faults.add(Fault(FaultAction.DUPLICATE_REPLY, match="Abort"))
        simulator.faults.add(Fault(FaultAction.DUPLICATE_REPLY, match="Stop"))
        assert stop_now(cell.url).state is ControllerState.READY


def asked_of(simulator):
    """Return the names of the received requests, in order."""
    return [text.split(",")[0].strip() for _, way, text in simulator.log if way == ">"]


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("action", [FaultAction.DROP_REPLY, FaultAction.TRUNCATE_REPLY])
def test_who_falls_silent_once_it_stands_is_told_nothing_more(serve, action):
    simulator = EpsonSimulator(seed=7)
    met: list[str] = []
    with serve(simulator) as cell:
        simulator.faults.add(Fault(action, match="GetContNo", position=7))
        assert stop_now(cell.url, timeout_s=0.2, met=met.append).ready
        asked = asked_of(simulator)
        with cell.connect() as controller:  # nobody is left logged in
            assert controller.status().ready
    assert met == []
    assert asked == ["$Login", "$Abort", "$Stop", "$GetStatus", "$GetContNo"]


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("request_", ["GetContNo", "GetRobotSerial"])
def test_who_seems_to_be_another_controller_the_second_time_is_not_named(serve, request_):
    simulator = EpsonSimulator(seed=7)
    named: list[str] = []
    with serve(simulator) as cell:
        stop_now(cell.url, met=named.append)
        assert len(named) == 1
        simulator.faults.add(Fault(FaultAction.GARBLE_REPLY, match=request_, position=-3))
        stop_now(cell.url, met=named.append)
        assert simulator.faults.pending == ()
        assert asked_of(simulator)[-1] == "$Logout"
    assert len(named) == 1


def test_who_cannot_say_who_it_is_is_logged_out_all_the_same(serve):
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(rc_plus=5, status_flags=10))
    met: list[str] = []
    with serve(simulator) as cell:
        assert stop_now(cell.url, met=met.append).ready
        assert asked_of(simulator)[-1] == "$Logout"
    assert met == []


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("second", ["ignored", "closed"])
def test_beside_a_client_that_is_logged_in_nobody_answers(serve, second):
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(second_client=second))
    with serve(simulator) as cell, cell.connect():
        with pytest.raises(LoginUnansweredError):
            stop_now(cell.url, timeout_s=0.2)


def test_a_password_is_given_once(serve):
    simulator = EpsonSimulator(seed=7, password=Secret("canary-right"))
    with serve(simulator) as cell:
        with pytest.raises(LoginRefusedError):
            stop_now(cell.url, password=Secret("canary-wrong"))
        assert stop_now(cell.url, password=Secret("canary-right")).ready


def test_a_controller_that_takes_no_stop_from_here_says_so(serve):
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(monitoring_only=True))
    with serve(simulator) as cell:
        with pytest.raises(RejectedError):
            stop_now(cell.url)


def test_nobody_there():
    with socket.socket() as taken:  # bound and not listening: nobody else gets the port
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(ConnectError):
            stop_now(f"epson+tcp://127.0.0.1:{taken.getsockname()[1]}", timeout_s=0.5)


def test_a_map_has_no_stop():
    with pytest.raises(RejectedError, match="neither moves nor stops"):
        stop_now("plc+modbus-tcp://127.0.0.1:1?map=x.toml")


ONE_CLIENT_EACH = ("modbus-rtu", "can-virtual", "can-multicast")
"""A serial line can be opened once; a CANopen node answers one SDO client at a time."""


@pytest.fixture(params=LINKS)
def plc(request):
    with served_plc(request.param) as cell:
        yield cell


@pytest.fixture(params=sorted(set(BACKENDS) - set(ONE_CLIENT_EACH)))
def shared_plc(request):
    with served_plc(request.param) as cell:
        yield cell


def test_a_group_that_another_moves_is_brought_to_rest_and_held(shared_plc):
    with shared_plc.connect() as controller:
        group = controller.groups[0]
        here = group.pose()
        group.move_to(above(here, 30), SLOW, box=ANYWHERE)
        status = stop_now(shared_plc.url)
        assert (status.running, status.paused) == (False, True)
        stands = group.pose()
        assert here.z_mm <= stands.z_mm < here.z_mm + 15
        assert stop_now(shared_plc.url).running is False  # it may be repeated
        with pytest.raises(NotReadyError, match="held by a stop"):
            group.move_to(above(here, 30), SLOW, box=ANYWHERE)
        assert group.pose().z_mm == pytest.approx(stands.z_mm, abs=1e-6)


def test_a_group_whose_client_died_is_brought_to_rest_and_held(plc):
    controller = plc.connect()
    group = controller.groups[0]
    here = group.pose()
    group.move_to(above(here, 30), SLOW, box=ANYWHERE)
    controller._mailbox.wire.close()
    status = stop_now(plc.url)
    assert (status.running, status.paused) == (False, True)
    with plc.connect() as controller:
        assert controller.groups[0].pose().z_mm < here.z_mm + 15


def test_a_beat_that_is_refused_holds_no_stop_back():
    refused = PlcFault(PlcFaultAction.MODBUS_EXCEPTION, match="beat", code=6, every=1)
    with served_plc("modbus-tcp") as cell, cell.connect(clock=cell.clock) as controller:
        controller.tools.write(3, ToolOffset(1.0, 2.0, 3.0), expected=ANY)
        cell.clock.advance(2.0)  # a beat is due
        cell.simulator.faults.add(refused)
        with pytest.raises(RemoteProtocolError, match="server busy"):
            controller.status()
        cell.clock.advance(2.0)
        controller.stop()
        assert cell.commands[-1] == "STOP"
        assert cell.simulator.faults.times_fired > 1


BUSY, NO_ANSWER_OF_THE_PLC = 6, 11
"""What a server, and a gateway to one, say of a look in a Modbus exception."""


@pytest.mark.parametrize(
    ("backend", "fault"),
    [
        ("modbus-tcp", PlcFault(PlcFaultAction.MODBUS_EXCEPTION, code=BUSY)),
        ("modbus-tcp", PlcFault(PlcFaultAction.MODBUS_EXCEPTION, code=NO_ANSWER_OF_THE_PLC)),
        pytest.param(
            "modbus-rtu",
            PlcFault(PlcFaultAction.MODBUS_EXCEPTION, code=BUSY),
            marks=pytest.mark.soak,
        ),
        pytest.param(
            "opcua", PlcFault(PlcFaultAction.OUT_OF_SERVICE), marks=pytest.mark.soak
        ),  # the server takes a second to come up
    ],
    ids=lambda value: value if isinstance(value, str) else f"{value.action.name}-{value.code}",
)
def test_no_look_of_an_open_session_holds_its_stop_back(backend, fault):
    with served_plc(backend) as cell, cell.connect(timeout_s=0.2) as controller:
        controller.take()
        cell.simulator.faults.add(replace(fault, match="read_", every=1))
        with pytest.raises((OutcomeUnknownError, TransportTimeoutError)) as unconfirmed:
            controller.stop()
        assert "press the emergency stop" in unconfirmed.value.remedy
        assert cell.commands == ["STOP"]
        cell.simulator.faults.forget()
        controller._mailbox.wire.close()
        with cell.connect() as later:
            assert later.status().paused


def test_looks_that_are_refused_for_a_moment_hold_no_stop_back():
    busy = PlcFaultAction.MODBUS_EXCEPTION
    with served_plc("modbus-tcp") as cell:
        for exchange in range(1, 5):
            cell.simulator.faults.add(PlcFault(busy, match="read_", code=6, on_exchange=exchange))
        stop_now(cell.url)
        assert set(cell.commands) == {"STOP"}
        assert cell.simulator.faults.times_fired == 4


@pytest.mark.parametrize("plc", few_links("modbus-rtu"), indirect=True)
def test_a_group_that_is_disabled_is_stopped_without_an_error(plc):
    with plc.connect() as controller:
        controller.motors(False)
    assert stop_now(plc.url).running is False
