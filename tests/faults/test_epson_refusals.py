"""Refusals, time-outs and faults of an EPSON controller while it is commanded (F17 to F20)."""

from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink import ToolOffset
from robolink.errors import (
    BusyError,
    ControllerFaultError,
    NotReadyError,
    OutcomeUnknownError,
    RejectedError,
    StoppedError,
    UnclearAnswerError,
)
from robolink.journal import memory_journal
from robolink.model import MotionOutcome, MotionProfile, Path, Verdict, WorkBox
from robolink.protocols.epson_text import Refusal
from robolink.transaction import recover
from tests.faults._bending_relay import BendingRelay

OLD, NEW = ToolOffset(12.5, -3.25, -20.0), ToolOffset(12.75, -3.0, -20.5)
SLOW = MotionProfile(Path.STRAIGHT, 1, 1.0)


@pytest.fixture
def make(serve_simulator):
    """Makes controllers in process, in simulated time, each with its link."""

    def made(**options):
        simulator = EpsonSimulator(seed=5, options=replace(EpsonOptions(), **options))
        simulator.machine.tools.set(1, OLD)
        return simulator, serve_simulator(simulator).url

    return made


def lift(controller, dz_mm=30.0, profile=SLOW):
    if not controller.status().running:
        controller.motors(True)
    group = controller.groups[0]
    here = group.pose()
    return group.move_to(replace(here, z_mm=here.z_mm + dz_mm), profile, box=WorkBox())


def sent(simulator, text):
    return [shown for _, way, shown in simulator.log if way == ">" and text in shown]


@pytest.mark.fault("F17")
@pytest.mark.parametrize(
    ("act", "reason"),
    [
        ("teach", "teach"),
        ("press_estop", "emergency_stop"),
        ("open_guard", "guard_open"),
        ("start_production", "running"),
    ],
)
def test_f17_a_state_that_forbids_a_movement_is_named_and_none_is_tried(make, act, reason):
    simulator, url = make()
    with robolink.connect(url) as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        getattr(simulator.panel, act)()
        with pytest.raises(NotReadyError) as refusal:
            group.move_to(replace(here, z_mm=here.z_mm + 1), SLOW, box=WorkBox())
        assert refusal.value.reason == reason
        assert controller.outcomes.open_markers() == ()
    assert sent(simulator, "Move XY") == []
    assert simulator.machine.arm.moves_started == 0


@pytest.mark.fault("F18")
def test_f18_during_a_movement_only_status_and_stop_leave_this_process(make):
    simulator, url = make()
    with robolink.connect(url) as controller:
        motion = lift(controller)
        before = len(simulator.log)
        for act in (
            lambda: controller.tools.read(1),
            lambda: controller.tools.write(1, NEW, expected=OLD),
            lambda: controller.tools.select(2),
            lambda: lift(controller),
        ):
            with pytest.raises((BusyError, NotReadyError)):
                act()
        assert controller.status().running
        since = list(simulator.log)[before:]
        names = {text.partition(",")[0] for _, way, text in since if way == ">"}
        assert names == {"$GetStatus"}
        controller.stop()
        with pytest.raises(StoppedError):
            motion.wait(timeout_s=5)
    assert simulator.machine.arm.moves_started == 1


@pytest.mark.fault("F18")
def test_f18_a_refusal_because_another_statement_runs_did_nothing_and_is_not_repeated(make):
    # The flags of this controller do not show what another client left running.
    simulator, url = make(flags_during_execute="ready", execute_on_disconnect="continues")
    with robolink.connect(url) as first:
        lift(first)
        simulator.panel.cut_link()
    outcomes = memory_journal("of another client").log("another client")
    with robolink.connect(url, outcomes=outcomes) as controller:
        with pytest.raises(RejectedError) as refusal:
            controller.tools.write(1, NEW, expected=OLD)
        assert refusal.value.code == 21
        assert outcomes.open_markers() == ()
    assert sent(simulator, "TLSet 1, XY") == []
    assert simulator.machine.tools.get(1) == OLD


def timing_out(request):
    """Return a function by which a relay turns the answer to ``request`` into an error 19, once."""
    asked: list[bytes] = []
    bent: list[bytes] = []

    def to_server(data):
        if request in data:
            asked.append(data)
        return data

    def to_client(data):
        # On a busy computer a piece holds further answers, which the client waits for.
        answers = data.splitlines(keepends=True)
        for number, answer in enumerate(answers):
            if asked and not bent and answer.startswith(b"#Execute"):
                bent.append(answer)
                answers[number] = b"!Execute,19\r\n"
        return b"".join(answers)

    return {"to_server": to_server, "to_client": to_client}


def served_with_time_out(request):
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    host = serve_tcp(simulator, clock=ScaledClock(40.0))
    port = int(host.url.rpartition(":")[2])
    relay = BendingRelay(port, **timing_out(request))
    return simulator, host, relay, host.url.replace(str(port), str(relay.port))


@pytest.mark.fault("F19")
def test_f19_a_write_that_the_controller_timed_out_is_read_and_not_called_refused():
    simulator, host, relay, url = served_with_time_out(b"TLSet 1, XY")
    with host, relay, robolink.connect(url, timeout_s=2.0) as controller:
        with pytest.raises(UnclearAnswerError, match="neither that it ran nor") as unclear:
            controller.tools.write(1, NEW, expected=OLD)
        assert "confirms that it ran" in unclear.value.what
        assert simulator.machine.tools.get(1) == NEW
        assert controller.outcomes.open_markers() == ()
    assert len(sent(simulator, "TLSet 1, XY")) == 1


@pytest.mark.fault("F19")
def test_f19_a_movement_that_the_controller_timed_out_is_unproved_and_blocks_the_next():
    simulator, host, relay, url = served_with_time_out(b"Move XY")
    with host, relay:
        with robolink.connect(url, timeout_s=2.0) as controller:
            with pytest.raises(OutcomeUnknownError, match="Execute,19"):
                lift(controller, 5.0, MotionProfile(Path.STRAIGHT, 5, 20.0)).wait(timeout_s=60)
            with pytest.raises(OutcomeUnknownError, match="recover"):
                lift(controller)
        with robolink.connect(url, timeout_s=2.0) as controller:
            (finding,) = recover(controller).left
            assert finding.verdict is Verdict.LOOK
            controller.resolver.settle(finding)
            profile = MotionProfile(Path.STRAIGHT, 5, 20.0)
            assert lift(controller, 5.0, profile).wait(timeout_s=60) is MotionOutcome.ARRIVED
    assert simulator.machine.arm.moves_started == 2


def test_a_movement_that_is_refused_while_the_arm_moves_is_unproved(make):
    """The refusal answered something else, such as a duplicated request."""
    simulator, url = make()
    with robolink.connect(url) as controller:
        motion = lift(controller)
        motion._pending.answer = Refusal("Execute", 21)
        assert simulator.machine.arm.moving
        with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
            motion.wait(timeout_s=60)
        assert len(controller.outcomes.open_markers()) == 1


@pytest.mark.fault("F20")
def test_f20_a_serious_error_in_a_movement_ends_it_and_no_reset_is_offered_or_sent(make):
    simulator, url = make()
    with robolink.connect(url) as controller:
        motion = lift(controller)
        simulator.panel.raise_serious_error()
        with pytest.raises(ControllerFaultError):
            motion.wait(timeout_s=60)
        with pytest.raises(NotReadyError, match="serious error") as refusal:
            lift(controller)
        assert refusal.value.reason == "serious_fault"
        assert "switch the controller off and on" in refusal.value.remedy
        with pytest.raises((NotReadyError, ControllerFaultError)) as no_help:
            controller.reset_fault()
        assert "off" in no_help.value.remedy
        assert sent(simulator, "$Reset") == []
    assert simulator.machine.arm.moves_started == 1
