"""A lost, late, doubled or damaged answer never costs a second move, and never leads to a lie."""

from contextlib import suppress
from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, FaultPlan
from robolink_simulators.testkit.media import served

import robolink
from robolink import ToolOffset
from robolink.controller_outcome import outcome_after
from robolink.errors import (
    OutcomeUnknownError,
    ReadBackError,
    RemoteProtocolError,
    RobolinkError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
    UnclearAnswerError,
)
from robolink.model import MotionOutcome, MotionProfile, Path, Verdict, WorkBox
from robolink.transaction import Wanted, change_tools

NEW = ToolOffset(12.75, -3.25, -20)
WRITE = "TLSet 1, XY"
MOVE = "Move XY"

LOST = {
    "dropped": FaultAction.DROP_REPLY,
    "truncated": FaultAction.TRUNCATE_REPLY,
    "cut off after it was carried out": FaultAction.DISCONNECT,
    "cut off before it was carried out": FaultAction.DISCONNECT_BEFORE,
}


def simulator_with(action, match):
    return EpsonSimulator(seed=5, faults=[Fault(action, on_exchange=0, match=match)])


def lift(controller, dz_mm=5.0, speed_mm_s=20.0):
    if controller.outcomes.open_markers() == ():
        controller.motors(True)
    group = controller.groups[0]
    here = group.pose()
    return group.move_to(
        replace(here, z_mm=here.z_mm + dz_mm),
        MotionProfile(Path.STRAIGHT, 5, speed_mm_s),
        box=WorkBox(),
    )


def write(controller):
    before = controller.tools.read(1)
    return controller.tools.write(1, NEW, expected=before)


@pytest.mark.parametrize("how", LOST)
def test_a_lost_answer_to_a_write_is_unknown_blocks_motion_and_is_settled_by_reading(serve, how):
    simulator = simulator_with(LOST[how], WRITE)
    applied = LOST[how] is not FaultAction.DISCONNECT_BEFORE
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
                write(controller)
            with pytest.raises(TransportClosedError):
                controller.status()
        with robolink.connect(url) as controller:
            with pytest.raises(OutcomeUnknownError, match="did not finish"):
                lift(controller)
            (marker,) = controller.outcomes.open_markers()
            finding = controller.resolver.examine(marker)
            assert finding.verdict is (Verdict.DONE if applied else Verdict.NOT_APPLIED)
            controller.resolver.settle(finding)
            lift(controller).wait(timeout_s=60)
    writes = [text for _, direction, text in simulator.log if WRITE in text]
    assert len(writes) == 1


@pytest.mark.fault("F25")
@pytest.mark.parametrize("how", LOST)
def test_f25_a_lost_answer_to_a_move_is_unknown_and_the_move_is_never_sent_twice(serve, how):
    simulator = simulator_with(LOST[how], MOVE)
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            started = simulator.machine.arm.moves_started
            with pytest.raises(OutcomeUnknownError):
                lift(controller).wait(timeout_s=2)
        with robolink.connect(url) as controller:
            with pytest.raises(OutcomeUnknownError, match="recover"):
                lift(controller)
            with pytest.raises(OutcomeUnknownError), controller.preserved("a procedure"):
                pass
            assert simulator.machine.arm.moves_started <= started + 1
            (marker,) = controller.outcomes.open_markers()
            finding = controller.resolver.examine(marker)
            assert finding.verdict is Verdict.LOOK
            controller.resolver.settle(finding)
            lift(controller).wait(timeout_s=60)


def test_flags_that_cannot_be_read_end_a_movement_and_leave_no_doubt_about_it(serve):
    """The link answers on, so the end is seen; nothing is left for anybody to look at."""
    simulator, fault = with_unreadable_flags()
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        moving = lift(controller, 40.0, speed_mm_s=1.0)
        simulator.faults.add(fault)
        with pytest.raises(RemoteProtocolError, match="is not a status") as told:
            moving.wait(timeout_s=60)
        assert not simulator.faults.pending
        assert controller.outcomes.open_markers() == ()
        assert outcome_after(told.value).settled
        assert not simulator.status_flags().running
        lift(controller, 1.0).wait(timeout_s=60)
    assert simulator.machine.arm.moves_started == 2
    assert len([text for _, way, text in simulator.log if way == ">" and "Abort" in text]) == 1


def with_unreadable_flags():
    """Return a simulator, and a fault that puts a letter into the code of its next GetStatus."""
    fault = Fault(FaultAction.GARBLE_REPLY, match="GetStatus", position=24)
    for seed in range(200):
        plan = FaultPlan(seed=seed)
        ((_, bent),) = plan.departures(b"#GetStatus,00100000010,0000\r\n", [fault])
        assert isinstance(bent, bytes)
        if bent[24:25].isalpha():
            return EpsonSimulator(seed=seed), fault
    raise AssertionError("no seed bends it so")


def test_a_time_out_ends_the_link_and_not_only_the_request():
    """A late answer could be taken for that of the next question."""
    simulator = simulator_with(FaultAction.DROP_REPLY, "GetStatus")
    with served(simulator) as url, robolink.connect(url, timeout_s=0.3) as controller:
        with pytest.raises(TransportTimeoutError):
            controller.status()
        asked = controller.exchanges
        with pytest.raises(TransportClosedError):
            controller.status()
        assert controller.exchanges == asked


@pytest.mark.fault("F26")
def test_f26_whichever_answer_is_lost_a_movement_is_begun_once():
    """In process and in simulated time: one run for each answer, until none is lost."""
    for lost in range(100):
        fault = Fault(FaultAction.DROP_REPLY, on_exchange=lost)
        simulator = EpsonSimulator(seed=5, faults=[fault])
        with (
            served(simulator) as url,
            suppress(RobolinkError),
            robolink.connect(url, timeout_s=0.3) as controller,
        ):
            lift(controller).wait(timeout_s=60)
        assert simulator.machine.arm.moves_started <= 1, f"answer {lost}"
        sent = [text for _, way, text in simulator.log if way == ">" and MOVE in text]
        assert len(sent) <= 1, f"answer {lost}"
        if simulator.faults.pending:
            break
    assert 10 < lost < 99


@pytest.mark.fault("F59")
def test_a_value_that_was_changed_meanwhile_is_a_conflict(serve):
    simulator = simulator_with(FaultAction.DROP_REPLY, WRITE)
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(OutcomeUnknownError):
                write(controller)
        simulator.machine.tools.set(1, ToolOffset(1, 1, 1))
        with robolink.connect(url) as controller:
            (marker,) = controller.outcomes.open_markers()
            finding = controller.resolver.examine(marker)
            assert finding.verdict is Verdict.CONFLICT
            assert "neither" in finding.sentence


@pytest.mark.fault("F43")
def test_a_write_that_is_acknowledged_but_not_applied_is_found_by_reading_back(serve):
    simulator = simulator_with(FaultAction.IGNORE_WRITE, WRITE)
    with serve(simulator) as url, robolink.connect(url) as controller:
        with pytest.raises(ReadBackError, match=r"reads back as X 12\.000"):
            write(controller)


@pytest.mark.parametrize("match", ["GetStatus", "Print TLDef(1)", "Print TLSet(1)"])
@pytest.mark.parametrize(
    "action", [FaultAction.DROP_REPLY, FaultAction.TRUNCATE_REPLY, FaultAction.GARBLE_REPLY]
)
def test_a_read_that_fails_ends_the_session_and_lies_about_nothing(serve, match, action):
    simulator = simulator_with(action, match)
    truth = simulator.machine.tools.get(1)
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            try:
                value = controller.tools.read(1)
            except RobolinkError:
                pass
            else:
                assert value == truth
        with robolink.connect(url) as controller:
            assert controller.tools.read(1) == truth


@pytest.mark.fault("F09")
def test_f09_a_doubled_answer_is_never_taken_for_the_next_one(serve):
    simulator = simulator_with(FaultAction.DUPLICATE_REPLY, "Print TLSet(1)")
    with serve(simulator) as url, robolink.connect(url) as controller:
        with pytest.raises((RemoteProtocolError, TransportError)):
            for _ in range(5):
                assert controller.tools.read(1) == simulator.machine.tools.get(1)
                assert controller.tools.selected() == 1


@pytest.mark.fault("F09")
def test_f09_a_movement_that_is_answered_twice_has_ended_and_leaves_no_doubt(serve):
    simulator = simulator_with(FaultAction.DUPLICATE_REPLY, "Move XY")
    with serve(simulator) as url:
        with robolink.connect(url) as controller:
            controller.motors(True)
            assert lift(controller).wait(timeout_s=30.0) is MotionOutcome.ARRIVED
            with pytest.raises((RemoteProtocolError, TransportError)):
                for _ in range(5):
                    controller.status()
        with robolink.connect(url) as controller:
            assert (
                lift(controller, -5.0).wait(timeout_s=30.0) is MotionOutcome.ARRIVED
            )  # nothing is blocked


@pytest.mark.fault("F01")
def test_f01_a_late_answer_dies_with_its_connection(serve):
    simulator = EpsonSimulator(
        seed=5,
        faults=[Fault(FaultAction.DELAY, on_exchange=0, match="Print Tool", seconds=30.0)],
    )
    with serve(simulator) as url:
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(TransportError):
                controller.tools.selected()
        with robolink.connect(url) as controller:
            assert controller.tools.selected() == 1
            assert controller.tools.read(1) == simulator.machine.tools.get(1)


@pytest.mark.fault("F05")
def test_an_answer_in_pieces_is_the_same_answer(serve):
    simulator = EpsonSimulator(
        seed=5,
        faults=[Fault(FaultAction.SPLIT_REPLY, on_exchange=n, match="TLSet") for n in (0, 1, 2)],
    )
    with serve(simulator) as url, robolink.connect(url) as controller:
        assert controller.tools.read_all()[1] == simulator.machine.tools.get(1)
        assert controller.tools.read(1) == simulator.machine.tools.get(1)


UNCLEAR = {
    # One bit of "#Execute,0" is flipped; the seed decides which.
    "the digit is another": (9, "#Execute,"),
    "the refusal sign stands before it": (0, "!Execute,0"),
}


@pytest.fixture
def unclear():
    """A simulator whose first acknowledgement of a request is altered beyond recognition."""

    def make(match, position, shown):
        for seed in range(100):
            plan = FaultPlan(seed=seed)
            fault = Fault(FaultAction.GARBLE_REPLY, match=match, position=position)
            ((_, bent),) = plan.departures(b"#Execute,0\r\n", [fault])
            assert isinstance(bent, bytes)
            if bent.startswith(shown.encode()) and bent[9:10].isdigit():
                return EpsonSimulator(seed=seed, faults=[fault])
        raise AssertionError("no seed bends it so")

    return make


@pytest.mark.parametrize("how", UNCLEAR)
def test_a_write_whose_acknowledgement_was_garbled_is_told_as_that(serve, unclear, how):
    simulator = unclear(WRITE, *UNCLEAR[how])
    told: list[str] = []
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        old = controller.tools.read(1)
        with pytest.raises(UnclearAnswerError, match="neither that it ran nor") as caught:
            change_tools(controller, [Wanted(1, NEW, old)], tell=told.append)
        assert simulator.machine.tools.get(1) == old
        assert controller.outcomes.open_markers() == ()
    assert "it ran.\n    The old value of tool 1 is back." in caught.value.what
    assert told == ["The old value of tool 1 is back."]
    assert len([text for _, _, text in simulator.log if WRITE in text]) == 2


def test_a_write_that_was_ignored_with_a_garbled_acknowledgement_is_told_as_that(serve, unclear):
    simulator = unclear(WRITE, 9, "#Execute,")
    simulator.faults.add(Fault(FaultAction.IGNORE_WRITE, match=WRITE))
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        old = controller.tools.read(1)
        with pytest.raises(UnclearAnswerError) as caught:
            change_tools(controller, [Wanted(1, NEW, old)])
        assert simulator.machine.tools.get(1) == old
        assert controller.outcomes.open_markers() == ()
    assert "did not run.\n    Tool 1 holds its old value." in caught.value.what


def test_a_tool_whose_first_definition_was_garbled_and_ignored_reads_as_undefined(serve, unclear):
    simulator = unclear("TLSet 2, XY", 9, "#Execute,")
    simulator.faults.add(Fault(FaultAction.IGNORE_WRITE, match="TLSet 2, XY"))
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        with pytest.raises(UnclearAnswerError, match="did not run"):
            controller.tools.write(2, NEW, expected=None)
        assert controller.outcomes.open_markers() == ()


def test_a_selection_whose_acknowledgement_was_garbled_is_read_and_put_back(serve, unclear):
    simulator = unclear("Tool 0", 9, "#Execute,")
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        with (
            pytest.raises(UnclearAnswerError, match="Tool 0 is selected now"),
            controller.preserved("a procedure"),
        ):
            controller.tools.select(0)
        assert simulator.machine.tools.selected == 1
        assert controller.outcomes.open_markers() == ()


def test_a_garbled_acknowledgement_keeps_nothing_from_being_put_back(serve, unclear):
    simulator = unclear("Speed 5, 5, 5", 9, "#Execute,")
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        simulator.machine.power_high = True
        with controller.preserved("a procedure"):
            lift(controller).wait(timeout_s=60)
            assert not simulator.machine.power_high
        assert simulator.machine.power_high
        assert simulator.faults.fired
        assert controller.outcomes.open_markers() == ()


def test_a_movement_whose_end_was_garbled_is_not_called_refused(serve, unclear):
    simulator = unclear(MOVE, 9, "#Execute,")
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        with pytest.raises(UnclearAnswerError, match="Check what it should have changed"):
            lift(controller).wait(timeout_s=60)
        assert simulator.machine.arm.moves_started == 1


def seed_that_bends_digits(position):
    """Return a seed with which a digit at ``position`` becomes another digit."""
    fault = Fault(FaultAction.GARBLE_REPLY, position=position)
    for seed in range(100):
        ((_, bent),) = FaultPlan(seed=seed).departures(b"5" * (position + 1), [fault])
        if isinstance(bent, bytes) and bent.isdigit():
            return seed
    raise AssertionError("no seed bends it so")


@pytest.mark.fault("F07")
@pytest.mark.parametrize(
    ("query", "before"),
    [
        ("Print Tool", ""),
        ("Print Power, Speed", ""),
        pytest.param("Print Power, Speed", "0 ", id="Speed(1)"),
        pytest.param("Print Power, Speed", "0 5 5 5 50 ", id="SpeedS(2)"),
    ],
)
@pytest.mark.parametrize("which", [0, 1])
def test_what_is_put_back_is_read_twice_before_it_is_trusted(serve, query, before, which):
    """One digit is altered into another digit: only the second reading shows it."""
    position = len('#Execute,"' + before)
    fault = Fault(FaultAction.GARBLE_REPLY, which, match=query, position=position)
    simulator = EpsonSimulator(seed=seed_that_bends_digits(position))
    simulator.faults.add(fault)
    with serve(simulator) as url, robolink.connect(url, timeout_s=0.5) as controller:
        with (
            pytest.raises(
                RemoteProtocolError,
                match=r"two different answers about its tool, power and speed: Tool .* Nothing was",
            ),
            controller.preserved("a procedure"),
        ):
            raise AssertionError("the procedure ran")
        assert controller.outcomes.open_markers() == ()
        with controller.preserved("a procedure"):
            controller.tools.select(0)
        assert simulator.machine.tools.selected == 1


def test_ctrl_c_while_leave_is_taken_tells_what_the_work_before_left():
    simulator = EpsonSimulator(seed=5)

    def interrupt(_, request):
        if "Logout" in request:
            raise KeyboardInterrupt

    with served(simulator) as url, pytest.raises(KeyboardInterrupt) as caught:
        with robolink.connect(url) as controller:
            before = write(controller).before
            simulator.on_request = interrupt
    stands = outcome_after(caught.value).tools[1]
    assert (stands.before, stands.holds) == (before.components(), NEW.components())
    assert simulator.machine.tools.get(1) == NEW
