"""A stop whose answers are lost is tried again, and never reported as done unseen (row F76)."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_cli import entry
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.controllers import EpsonController, stop_now
from robolink.errors import RobolinkError
from robolink.model import ControllerState, MotionProfile, Path, WorkBox
from tests.contract._softmotion_cell import SLOW, above, served

TRIES = 3
CREEPING = MotionProfile(Path.STRAIGHT, 5, 1.0)


@contextmanager
def creeping_robot() -> Iterator[tuple[EpsonSimulator, str]]:
    """Serve a robot that moves 30 mm and whose client is gone."""
    simulator = EpsonSimulator(seed=7)
    with serve_tcp(simulator) as host:
        controller = robolink.connect(host.url)
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        group.move_to(replace(here, z_mm=here.z_mm + 30), CREEPING, box=WorkBox())
        assert isinstance(controller, EpsonController)
        controller._close_link()
        yield simulator, host.url


def losing(simulator: EpsonSimulator, request: str, times: int) -> None:
    for number in range(times):
        simulator.faults.add(Fault(FaultAction.DROP_REPLY, on_exchange=number, match=request))


@pytest.mark.fault("F76")
@pytest.mark.parametrize("request_", ["$Abort", "$Stop", "$GetStatus"])
def test_f76_a_stop_that_is_never_answered_is_repeated_and_then_says_what_to_press(
    request_, capsys
):
    with creeping_robot() as (simulator, url):
        losing(simulator, request_, TRIES)
        before = len(simulator.log)
        code = entry.run(["-c", url, "--timeout", "1", "stop"])
        said = capsys.readouterr()
        assert code not in (0, 70)
        assert "emergency stop" in said.err
        assert "has stopped" not in said.out
        since = list(simulator.log)[before:]
        asked = [text for _, way, text in since if way == ">" and request_ in text]
        assert len(asked) == TRIES
        # Nothing is lost any more: the next client sees that it has stopped.
        assert stop_now(url).state is ControllerState.READY
        assert not simulator.machine.arm.moving


@pytest.mark.fault("F76")
def test_f76_a_stop_of_the_library_that_is_not_answered_is_no_success():
    simulator = EpsonSimulator(seed=7)
    with serve_tcp(simulator) as host, robolink.connect(host.url, timeout_s=1.0) as controller:
        losing(simulator, "$Abort", 1)
        with pytest.raises(RobolinkError) as unconfirmed:
            controller.stop()
        assert "press the emergency stop" in unconfirmed.value.remedy
        with pytest.raises(robolink.errors.StoppedError):  # and nothing leaves all the same
            controller.motors(True)


@pytest.mark.fault("F76")
def test_f76_a_lost_stop_of_a_plc_is_sent_again_until_it_is_seen_to_rest():
    with served("modbus-tcp") as cell:
        with cell.connect() as controller:
            group = controller.groups[0]
            group.move_to(above(group.pose(), 20.0), SLOW, box=WorkBox())
            for number in range(TRIES - 1):
                fault = PlcFault(
                    PlcFaultAction.DISCONNECT, on_exchange=number, match="write_command STOP"
                )
                cell.simulator.faults.add(fault)
            assert stop_now(cell.url, timeout_s=1.0).running is False
            assert cell.simulator.faults.pending == ()
            assert cell.movements_started == 1
