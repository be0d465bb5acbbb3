"""Errors of an EPSON controller name the controller and the request."""

from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction

import robolink
from robolink import Secret
from robolink.controllers import stop_now
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    LoginRefusedError,
    LoginUnansweredError,
    NotReadyError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import MotionProfile, Path, WorkBox
from tests.contract.conftest import served

CREEPING = MotionProfile(Path.STRAIGHT, 5, 1.0)


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


@pytest.fixture
def cell(simulator):
    with served("sim", simulator) as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect(timeout_s=0.5) as controller:
        yield controller


@pytest.fixture
def named(cell):
    """The error of an act: its class, whether it names this controller, and the request."""

    def names(act, *given, **options):
        with pytest.raises(RobolinkError) as caught:
            act(*given, **options)
        error = caught.value
        return type(error), error.controller == cell.url, error.request

    return names


def upward(controller):
    group = controller.groups[0]
    here = group.pose()
    target = replace(here, z_mm=here.z_mm + 1)
    (*_, request) = group.requests_for(target, CREEPING)
    statement = request.removeprefix('$Execute,"').removesuffix('"')
    return lambda: group.move_to(target, CREEPING, box=WorkBox()), statement


def test_what_could_not_be_watched_or_has_no_power_does_not_begin(cell, controller, named):
    controller.motors(False)
    group = controller.groups[0]
    move, statement = upward(controller)
    assert named(move) == (NotReadyError, True, statement)
    assert named(group.require_able, "a trial") == (NotReadyError, True, "a trial")
    controller.close()
    with cell.connect(remote_timeout_s=0.0) as unwatched:
        move, statement = upward(unwatched)
        assert named(move) == (NotReadyError, True, statement)
        able = unwatched.groups[0].require_able
        assert named(able, "a trial") == (NotReadyError, True, "a trial")


def test_a_reset_that_helps_nothing(simulator, controller, named):
    simulator.panel.press_estop()
    assert named(controller.reset_fault) == (ControllerFaultError, True, "Reset")
    simulator.panel.release_estop()
    controller.reset_fault()
    simulator.panel.open_guard()
    assert named(controller.reset_fault) == (NotReadyError, True, "Reset")


def test_a_login_that_fails(simulator, cell, named):
    with cell.connect():
        assert named(cell.connect, timeout_s=0.2) == (LoginUnansweredError, True, "Login")
        assert named(stop_now, cell.url, timeout_s=0.2) == (LoginUnansweredError, True, "Login")
    simulator.faults.add(Fault(FaultAction.DISCONNECT, match="Login"))
    assert named(cell.connect) == (LoginUnansweredError, True, "Login")


def test_a_password_that_is_refused():
    simulator = EpsonSimulator(seed=7, password=Secret("canary-right"))
    with served("sim", simulator) as cell:
        for act in (robolink.connect, stop_now):
            with pytest.raises(LoginRefusedError) as refused:
                act(cell.url, password=Secret("canary-wrong"))
            assert (refused.value.controller, refused.value.request) == (cell.url, "Login")


@pytest.mark.parametrize(
    ("action", "kind", "request_"),
    [
        (FaultAction.DROP_REPLY, TransportTimeoutError, ""),
        (FaultAction.TRUNCATE_REPLY, TransportTimeoutError, "Abort"),
        (FaultAction.DISCONNECT, TransportBrokenError, ""),
    ],
)
def test_a_stop_that_is_not_answered(simulator, cell, named, action, kind, request_):
    for number in range(3):
        simulator.faults.add(Fault(action, on_exchange=number, match="Abort"))
    assert named(stop_now, cell.url, timeout_s=0.2) == (kind, True, request_)


def test_an_answer_that_nobody_asked_for(simulator, controller, named):
    simulator.faults.add(Fault(FaultAction.DUPLICATE_REPLY, match="GetStatus"))
    controller.status()
    assert named(controller.status) == (RemoteProtocolError, True, "")


def test_values_that_are_not_there_or_make_no_sense(controller, named, monkeypatch):
    monkeypatch.setattr(controller.io, "read_memory", lambda _bit: False)
    memory = controller.io.set_memory
    assert named(memory, 3, True) == (ReadBackError, True, "$SetMemIO,3,1")
    assert named(controller.variables.text, "nobody") == (RejectedError, True, "GetVariable")
    assert named(controller.alarms.reset, 501) == (RejectedError, True, "ResetAlm")
    assert named(controller.require_looks) == (ConfigError, True, "")
