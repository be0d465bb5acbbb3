"""A stop whose answers are lost is tried again, and never reported as done unseen (row F76)."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

import pytest
from robolink_cli import entry
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.testkit.media import served as served_epson

import robolink
from robolink.controllers import EpsonController, stop_now
from robolink.errors import OutcomeUnknownError, RobolinkError, TransportClosedError
from robolink.model import Controller, ControllerState, Motion, MotionProfile, Path, WorkBox
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
        losing(simulator, "$Abort", 1 + TRIES)
        with pytest.raises(RobolinkError) as unconfirmed:
            controller.stop()
        assert "press the emergency stop" in unconfirmed.value.remedy
        with pytest.raises(robolink.errors.StoppedError):  # and nothing leaves all the same
            controller.motors(True)


@contextmanager
def creeping_robot_of_this_session() -> Iterator[tuple[EpsonSimulator, Motion]]:
    """Serve a robot that moves 60 mm at 5 mm/s; nobody waits for it yet."""
    simulator = EpsonSimulator(seed=7)
    with served_epson(simulator, "tcp") as url, robolink.connect(url, timeout_s=1.0) as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        target = replace(here, z_mm=here.z_mm + 60)
        yield (
            simulator,
            group.move_to(target, replace(CREEPING, speed_mm_s=5.0), box=WorkBox()),
        )


@contextmanager
def watched_robot(media: str = "tcp") -> Iterator[tuple[EpsonSimulator, Controller, str]]:
    """Serve a robot that moves 60 mm at 5 mm/s; another thread waits for it."""
    simulator = EpsonSimulator(seed=7)
    with served_epson(simulator, media) as url, robolink.connect(url, timeout_s=1.0) as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        motion = group.move_to(
            replace(here, z_mm=here.z_mm + 60), replace(CREEPING, speed_mm_s=5.0), box=WorkBox()
        )

        def wait() -> None:
            with suppress(RobolinkError):
                motion.wait(timeout_s=60)

        waiter = threading.Thread(target=wait)
        waiter.start()
        try:
            yield simulator, controller, url
        finally:
            controller.close()
            waiter.join(30)


@pytest.mark.fault("F76")
@pytest.mark.parametrize("media", ["tcp", pytest.param("serial", marks=pytest.mark.soak)])
@pytest.mark.parametrize("lost", ["before", "$Abort", "$Stop", "$GetStatus"])
@pytest.mark.parametrize("how", [FaultAction.DROP_REPLY, FaultAction.DISCONNECT])
def test_f76_a_stop_goes_out_over_a_new_link_where_the_session_is_over(media, lost, how):
    with watched_robot(media) as (simulator, controller, url):
        arm = simulator.machine.arm
        while not arm.moving:
            controller.clock.sleep(0.01)
        request = "$GetStatus" if lost == "before" else lost
        simulator.faults.add(Fault(how, match=request))
        if lost == "before":
            with pytest.raises(RobolinkError):
                controller.status()
            assert arm.moving
        assert stop_now(controller).state is ControllerState.READY
        assert not arm.moving
        assert controller.latch.closed
        with pytest.raises(RobolinkError):
            controller.motors(True)
        with robolink.connect(url) as after:
            assert after.status().state is ControllerState.READY
            assert after.groups[0].pose().z_mm < 40  # of 60


@pytest.mark.fault("F76")
def test_f76_two_stops_at_once_go_out_over_new_links_one_after_the_other():
    """Whoever asks a controller for a second login gets no answer."""
    with watched_robot() as (simulator, controller, _):
        while not simulator.machine.arm.moving:
            controller.clock.sleep(0.01)
        simulator.faults.add(Fault(FaultAction.DISCONNECT, match="$GetStatus"))
        with pytest.raises(RobolinkError):
            controller.status()
        ends: list[object] = []

        def stop() -> None:
            try:
                controller.stop()
                ends.append("stopped")
            except RobolinkError as error:
                ends.append(error)

        threads = [threading.Thread(target=stop) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        assert ends == ["stopped"] * 3
        assert not simulator.machine.arm.moving


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [FaultAction.DROP_REQUEST, FaultAction.DISCONNECT_BEFORE])
def test_f76_ctrl_c_stops_the_robot_although_its_abort_got_lost(how):
    with creeping_robot_of_this_session() as (simulator, motion):
        simulator.faults.add(Fault(how, match="$Abort"))
        ctrl_c = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
        ctrl_c.start()
        with pytest.raises((OutcomeUnknownError, KeyboardInterrupt)):
            motion.wait(timeout_s=60)
        ctrl_c.join()
        assert not simulator.machine.arm.moving
        assert not simulator.faults.pending


@pytest.mark.fault("F76")
def test_f76_what_only_takes_too_long_is_left_alone_where_its_abort_got_lost():
    """Nobody is there who wants it: the robot goes on to its target, and that is not known."""
    with creeping_robot_of_this_session() as (simulator, motion):
        simulator.faults.add(Fault(FaultAction.DISCONNECT_BEFORE, match="$Abort"))
        with pytest.raises(OutcomeUnknownError):
            motion.wait(timeout_s=0.5)
        assert simulator.machine.arm.moving


@pytest.mark.fault("F76")
def test_f76_a_session_that_was_closed_stops_nothing():
    """Somebody else may work with the robot by then."""
    with served_epson(EpsonSimulator(seed=7), "tcp") as url:
        controller = robolink.connect(url)
        controller.close()
        with pytest.raises(TransportClosedError):
            controller.stop()


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [PlcFaultAction.DISCONNECT_BEFORE, PlcFaultAction.DISCONNECT])
def test_f76_a_stop_of_a_plc_goes_out_over_a_new_link_where_the_session_is_over(how):
    with served("modbus-tcp") as cell, cell.connect() as controller:
        group = controller.groups[0]
        group.move_to(above(group.pose(), 20.0), SLOW, box=WorkBox())
        cell.simulator.faults.add(PlcFault(how, match="write_command STOP"))
        controller.stop()
        assert cell.commands.count("STOP") >= 1
        with cell.connect() as after:
            assert after.status().paused
            assert not after.status().running


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
