"""An acceleration that a cell states: lowered before a straight movement, and put back.

It is never raised, costs no request more than without it, and a measurement that was made with
another one than its run-up was calculated from does not count.
"""

from contextlib import contextmanager, suppress
from dataclasses import replace

import pytest
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.statements.settings import SETTINGS

from robolink.controllers.epson.session import EpsonSession
from robolink.errors import (
    CalibrationError,
    ConfigError,
    ControllerError,
    NotReadyError,
    NotReadyReason,
    RobolinkError,
    StoppedError,
)
from robolink.methods import BeamsParameters
from robolink.methods.beams.drive import require_run_up
from robolink.model import InputEdge, MotionOutcome, MotionProfile, Path, Verdict, WorkBox
from tests.contract._epson_wire_promises import SETS_BACK, sent, settings_in
from tests.contract.conftest import served

pytestmark = [pytest.mark.simulator_only]

STATED = 150
STRAIGHT = MotionProfile(Path.STRAIGHT, 5, 20.0)
JOINT = MotionProfile(Path.JOINT, 5, 20.0)
EVERYWHERE = WorkBox()
INPUT, PLATE_BELOW_MM = 3, 2.0


@contextmanager
def opened(stated=STATED, simulator=None, **options):
    """Yield a simulator with its motors on, and a controller whose cell states this."""
    simulator = simulator or EpsonSimulator(seed=7, options=EpsonOptions(**options))
    simulator.machine.motors_on = True
    with served("sim", simulator) as cell, cell.connect(acceleration_mm_s2=stated) as controller:
        yield simulator, controller


def start(controller, profile=STRAIGHT, dz_mm=0.5):
    group = controller.groups[0]
    here = group.pose()
    return group.move_to(replace(here, z_mm=here.z_mm + dz_mm), profile, box=EVERYWHERE)


def lift(controller, profile=STRAIGHT):
    assert start(controller, profile).wait(timeout_s=60) is MotionOutcome.ARRIVED


def down(controller, *, run_on=False):
    group = controller.groups[0]
    here = group.pose()
    target = replace(here, z_mm=here.z_mm - 2 * PLATE_BELOW_MM)
    edge = InputEdge(INPUT, run_on=run_on)
    return group.move_until_input(target, edge, speed_mm_s=5, box=EVERYWHERE)


def plate(simulator):
    below_mm = simulator.world.tip_mm()[2] - PLATE_BELOW_MM
    simulator.world.connect(INPUT, TouchPlate(below_mm))


def accel_s(simulator, *values):
    """Set AccelS as another program would, and return all of it."""
    if values:
        simulator.machine.parameters.accel_s = values if len(values) == 6 else values * 3
    return simulator.machine.parameters.accel_s


def test_it_is_lowered_where_it_is_higher_and_never_raised():
    with opened() as (simulator, controller):
        lift(controller)
        for before, expected in (
            ((200.0, 200.0), ["AccelS 150.000, 150.000"]),
            ((5000.0, 80.0), ["AccelS 150.000, 80.000"]),
            ((120.0, 4000.0), ["AccelS 120.000, 150.000"]),
            ((150.0, 150.0), []),
            ((90.0, 90.0), []),
        ):
            accel_s(simulator, *before)
            begun = len(simulator.log)
            lift(controller)
            assert settings_in(sent(simulator, begun)) == expected, before
            now = accel_s(simulator)[:2]
            assert now == tuple(min(one, STATED) for one in before)


def test_a_joint_movement_does_not_set_it():
    with opened() as (simulator, controller):
        lift(controller, JOINT)
        accel_s(simulator, 900.0, 900.0)
        begun = len(simulator.log)
        lift(controller, JOINT)
        assert settings_in(sent(simulator, begun)) == []


@pytest.mark.parametrize("comma", ["numeric", "nothing"])
def test_a_movement_takes_no_request_more(comma):
    each = []
    for stated in (None, STATED):
        with opened(stated, comma_blank=comma) as (simulator, controller):
            plate(simulator)
            lift(controller)
            begun = controller.exchanges
            lift(controller)
            if comma == "numeric":  # value by value, each value is a request
                down(controller).wait(timeout_s=60)
                each.append(controller.exchanges - begun)
            told = [text for text in sent(simulator) if "AccelS" in text]
            assert bool(told) is (stated is not None)
    assert len(set(each)) <= 1, each


@pytest.mark.parametrize("act", SETS_BACK)
def test_after_a_stop_a_reset_or_motor_on_it_is_set_anew_although_it_reads_right(act):
    with opened() as (simulator, controller):
        lift(controller)
        begun = len(simulator.log)
        SETS_BACK[act](controller)
        lift(controller)
        anew = ["Power Low", "Speed 5", "SpeedS 20.000", "AccelS 150.000, 150.000"]
        assert settings_in(sent(simulator, begun))[-4:] == anew


def test_what_is_set_anew_is_not_raised_either():
    with opened() as (simulator, controller):
        lift(controller)
        controller.stop()
        controller.release_stop()
        accel_s(simulator, 120.0, 100.0)
        begun = len(simulator.log)
        lift(controller)
        assert settings_in(sent(simulator, begun))[-1] == "AccelS 120.000, 100.000"


def test_motor_on_puts_back_what_the_controller_has_and_the_next_movement_lowers_it_again():
    with opened() as (simulator, controller):
        lift(controller)
        simulator.machine.switch_motors(True)  # by a person: no request of robolink's
        assert accel_s(simulator)[0] == 200.0
        lift(controller)
        assert accel_s(simulator)[0] == STATED


BEFORE = (5000.0, 4000.0, 300.0, 250.0, 123.45678, 99.0)


@pytest.mark.parametrize("ended_by", ["its end", "an error", "motor on", "a stop"])
def test_all_six_values_of_before_are_put_back_at_every_end(ended_by):
    with opened() as (simulator, controller):
        accel_s(simulator, *BEFORE)
        with suppress(ValueError, StoppedError), controller.preserved("a test"):
            lift(controller)
            assert accel_s(simulator)[:2] == (STATED, STATED)
            if ended_by == "an error":
                raise ValueError
            if ended_by == "motor on":
                controller.motors(True)
            if ended_by == "a stop":
                controller.stop()
        # Three decimals are sent; the controller's own fifth decimal is beyond what it prints.
        assert accel_s(simulator) == pytest.approx(BEFORE, abs=0.0005)
        assert controller.outcomes.open_markers() == ()


def test_if_it_cannot_be_put_back_the_rest_is_and_the_marker_stays(monkeypatch):
    def refused(_machine, values):
        if len(values) > 2:
            raise SpelRefusal(RefusalKind.FORMAT, "two at most")
        return lowered(_machine, values)

    lowered = SETTINGS["accels"]
    monkeypatch.setitem(SETTINGS, "accels", refused)
    with opened(error_state_after_failed_execute=False) as (simulator, controller):
        accel_s(simulator, *BEFORE)
        simulator.machine.parameters.speed_s = (300.0, 200.0, 100.0)
        with pytest.raises(RobolinkError), controller.preserved("a test"):
            lift(controller)
        assert simulator.machine.parameters.speed_s == (300.0, 200.0, 100.0)
        (marker,) = controller.outcomes.open_markers()
        monkeypatch.undo()
        controller.resolver.settle(controller.resolver.examine(marker))
        assert accel_s(simulator) == pytest.approx(BEFORE, abs=0.0005)


def test_a_procedure_that_changed_nothing_sends_nothing():
    with opened() as (simulator, controller):
        accel_s(simulator, *BEFORE)
        with controller.preserved("a test"):
            pass
        assert settings_in(sent(simulator)) == []
        assert accel_s(simulator) == BEFORE


@pytest.mark.parametrize("selects", [True, False])
def test_a_kill_leaves_a_marker_and_recover_puts_it_back_without_the_cell_file(selects):
    simulator = EpsonSimulator(seed=7)
    accel_s(simulator, *BEFORE)
    with opened(simulator=simulator) as (_, controller):
        outcomes = controller.outcomes
        held = controller.preserved("a test")
        held.__enter__()
        if selects:
            controller.tools.select(0)
        controller.groups[0].settings.slow_down(STRAIGHT)
        controller._link.session.close()  # killed: nothing is put back
    assert accel_s(simulator)[:2] == (STATED, STATED)
    simulator.machine.parameters.speed = simulator.machine.parameters.speed_s = (5, 5, 5)
    with served("sim", simulator) as cell, cell.connect(outcomes=outcomes) as controller:
        (marker,) = controller.outcomes.open_markers()
        assert marker.details["accel_s_mm_s2"] == list(BEFORE)
        finding = controller.resolver.examine(marker)
        assert finding.verdict is Verdict.NOT_RESTORED
        assert "acceleration" in finding.action
        controller.resolver.settle(finding)
        assert accel_s(simulator) == pytest.approx(BEFORE, abs=0.0005)
        assert controller.outcomes.open_markers() == ()
        assert controller.resolver  # and nothing is sent a second time
        begun = len(simulator.log)
        lift(controller)
        assert not any("AccelS" in text for text in sent(simulator, begun))


def test_only_the_acceleration_that_is_left_is_found_too():
    simulator = EpsonSimulator(seed=7)
    accel_s(simulator, *BEFORE)
    with opened(simulator=simulator) as (_, controller):
        with controller.preserved("a test"):
            (marker,) = controller.outcomes.open_markers()
            assert controller.resolver.examine(marker).verdict is Verdict.DONE
            accel_s(simulator, *BEFORE[:5], 99.002)
            assert controller.resolver.examine(marker).verdict is Verdict.NOT_RESTORED


def test_a_marker_of_a_cell_that_states_none_does_not_touch_it():
    with opened(None) as (simulator, controller):
        accel_s(simulator, *BEFORE)
        with controller.preserved("a test"):
            (marker,) = controller.outcomes.open_markers()
            assert "accel_s_mm_s2" not in marker.details
            lift(controller)
            accel_s(simulator, 77.0, 77.0)
        assert accel_s(simulator)[:2] == (77.0, 77.0)
        assert not any("AccelS" in text for text in sent(simulator))


@pytest.mark.parametrize("stored", [151.0, 150.001])
def test_a_controller_that_keeps_a_higher_one_moves_nothing(monkeypatch, stored):
    def rounded_up(machine, _values):
        machine.parameters.accel_s = (stored,) * 6
        return ""

    monkeypatch.setitem(SETTINGS, "accels", rounded_up)
    with opened() as (simulator, controller):
        moves = simulator.machine.arm.moves_started
        with pytest.raises(NotReadyError) as refusal:
            start(controller)
        assert refusal.value.reason is NotReadyReason.ACCELERATION
        assert simulator.machine.arm.moves_started == moves


def test_one_that_reads_back_rounded_down_is_not_set_again(monkeypatch):
    def rounded_down(machine, _values):
        machine.parameters.accel_s = (149.6,) * 6
        return ""

    monkeypatch.setitem(SETTINGS, "accels", rounded_down)
    with opened() as (simulator, controller):
        lift(controller)
        begun = len(simulator.log)
        lift(controller)
        assert settings_in(sent(simulator, begun)) == []


@pytest.mark.parametrize(
    ("found", "stated", "told"),
    [((200.0, 200.0), 100, 100), ((200.0, 120.0), 150, 120), ((90.0, 200.0), 300, 90)],
)
def test_the_run_up_is_that_of_the_lower_one(found, stated, told):
    with opened(stated) as (simulator, controller):
        accel_s(simulator, *found)
        group = controller.groups[0]
        assert group.run_up_mm(8.0) == pytest.approx(8.0**2 / (2 * told))
        assert group.deceleration_mm_s2() == min(found[1], stated)


def test_crossings_for_which_the_stated_one_is_too_low_are_refused():
    plan = BeamsParameters(search_mm=1.5, crossing_mm_s=8)
    with opened(None) as (_, controller):
        require_run_up(controller.groups[0], plan, change_mm=2)
    with opened(120) as (_, controller):
        with pytest.raises(CalibrationError, match=r"needs 0\.27 mm") as refusal:
            require_run_up(controller.groups[0], plan, change_mm=2)
    assert refusal.value.code == "run_up_too_short"


@pytest.mark.parametrize("other", [(100.0, 150.0), (150.0, 100.0)])
def test_a_search_with_another_acceleration_than_its_run_up_moves_nothing(other):
    with opened() as (simulator, controller):
        plate(simulator)
        controller.groups[0].run_up_mm(5.0)
        lift(controller)
        accel_s(simulator, *other)  # another program: lower, so robolink would not set it
        moves = simulator.machine.arm.moves_started
        with pytest.raises(NotReadyError, match=r"150, 150.*100") as refusal:
            down(controller)
        assert refusal.value.reason is NotReadyReason.ACCELERATION
        assert simulator.machine.arm.moves_started == moves
        assert controller.outcomes.open_markers() == ()
        controller.groups[0].run_up_mm(5.0)  # calculated anew, with what is in force
        assert down(controller).wait(timeout_s=60) is not None


@pytest.mark.parametrize(
    ("run_on", "other"), [(False, (400.0, 400.0)), (True, (60.0, 150.0))], ids=str
)
def test_a_search_during_which_another_program_set_it_does_not_count(monkeypatch, run_on, other):
    sends = EpsonSession.start_execute

    def overtaken(session, statement):
        accel_s(simulator, *other)  # after the look, before the movement
        return sends(session, statement)

    with opened() as (simulator, controller):
        plate(simulator)
        lift(controller)
        with monkeypatch.context() as patched:
            patched.setattr(EpsonSession, "start_execute", overtaken)
            motion = down(controller, run_on=run_on)
        with pytest.raises(ControllerError, match="changed during the movement") as refusal:
            motion.wait(timeout_s=60)
        assert refusal.value.remedy
        assert controller.outcomes.open_markers() == ()
        lift(controller)
        assert max(accel_s(simulator)[:2]) <= STATED


def test_what_no_cell_may_state_is_refused_before_anything_is_sent():
    with served("sim", EpsonSimulator(seed=7)) as cell:
        for stated in (0, 99, 35_001, -150, 150.0, True, "150"):
            with pytest.raises(ConfigError, match="acceleration"):
                cell.connect(acceleration_mm_s2=stated)
        assert cell.simulator is not None
        assert not list(cell.simulator.log)


def test_the_preview_shows_the_most_that_is_set():
    with opened() as (simulator, controller):
        group = controller.groups[0]
        here = group.pose()
        straight = group.requests_for(here, STRAIGHT)
        assert '$Execute,"AccelS 150.000, 150.000"' in straight
        until = group.requests_until(here, InputEdge(INPUT), speed_mm_s=5)
        assert '$Execute,"AccelS 150.000, 150.000"' in until
        assert settings_in(sent(simulator)) == []
