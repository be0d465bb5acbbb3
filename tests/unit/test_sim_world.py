"""The true world, and the person who looks at it: as they should, and otherwise."""

import math
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from statistics import fmean, pstdev

import pytest
import robolink_cli.prompts.operator as _operator
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import (
    LEAST_THINKING_S,
    AssistClient,
    InProcessEyes,
    perform,
    serve_assist,
)
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.kinematics import continued
from robolink_simulators.epson.arm.robots import robots
from robolink_simulators.epson.world import STORED
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import ConfigError
from robolink.model import ToolOffset, WorkBox
from robolink.runner import Question, Runner, RunSettings, ask_for_pose
from tests._rows import each_row

# The true world, and the person who looks at it.

CHOSEN = (  # one of each family and mount
    *("T6-602S", "GX4-C251S", "GX4-C351S-L", "GX8-C652SR", "RS4-C351S", "RS6-C552C", "G1-171S"),
    *("C8-C901S", "C8-C1401CR", "C12-C1401S", "CX4-A601S", "CX7-A901SR", "C4-A601S", "VT6L"),
)


@each_row("model", [model.name for model in robots()])
def test_every_robot_starts_beside_its_pin_and_above_it(model):
    world = EpsonSimulator(model, seed=len(model)).world
    x_mm, y_mm, z_mm = (p - t for p, t in zip(world.pin_mm, world.tip_mm(), strict=True))
    assert 5 <= math.hypot(x_mm, y_mm) <= 13
    assert -6.01 <= z_mm <= -2.99


@each_row("model", CHOSEN)
@each_row("u_deg", [0, 180])
def test_the_tip_reaches_the_pin_with_both_angles(model, u_deg):
    simulator = EpsonSimulator(model)
    simulator.panel.teach()
    arm = simulator.machine.arm
    turned = replace(arm.flange(), u_deg=u_deg)
    arm.place(continued(arm.model, turned, arm.joints), 0)
    simulator.world.operator.jog_onto_pin()
    assert simulator.world.tip_mm() == pytest.approx(simulator.world.pin_mm, abs=0.1)


def test_the_nozzle_was_changed_by_some_tenths_of_a_millimetre():
    simulator = EpsonSimulator(seed=4)
    tip = simulator.world.tips[1]
    stored = simulator.machine.tools.get(1)
    assert stored == STORED
    assert simulator.machine.tools.selected == 1
    for axis in ("x_mm", "y_mm", "z_mm"):
        assert 0.2 <= abs(getattr(tip, axis) - getattr(stored, axis)) <= 0.6


def test_a_seed_gives_the_same_world_again_and_another_seed_another():
    assert EpsonSimulator(seed=5).world.truth() == EpsonSimulator(seed=5).world.truth()
    assert EpsonSimulator(seed=5).world.truth() != EpsonSimulator(seed=6).world.truth()


def test_the_eye_errs_the_same_way_as_long_as_the_arm_stays():
    operator = EpsonSimulator().world.operator
    assert operator.look() == operator.look()


def test_the_eye_errs_by_its_stated_error():
    simulator = EpsonSimulator()
    world, arm = simulator.world, simulator.machine.arm
    errors = []
    for step in range(400):
        joints = arm.joints
        arm.place(joints.at_height(joints.j3_mm + (0.01 if step % 2 else -0.01)), 0)
        seen = world.operator.look()
        errors.append(seen.dx_mm - (world.pin_mm[0] - world.tip_mm()[0]))
    assert pstdev(errors) == pytest.approx(world.operator_sigma_mm, rel=0.2)


def test_jogging_ends_where_the_eye_sees_no_gap_and_keeps_u():
    simulator = EpsonSimulator()
    simulator.panel.teach()
    world = simulator.world
    before = simulator.machine.arm.flange()
    flange = world.operator.jog_onto_pin()
    seen = world.operator.look()
    assert (seen.dx_mm, seen.dy_mm, seen.dz_mm) == pytest.approx((0, 0, 0), abs=1e-9)
    assert flange.u_deg == pytest.approx(before.u_deg, abs=1e-9)
    assert 0 < math.dist(world.tip_mm(), world.pin_mm) < 6 * world.operator_sigma_mm
    assert simulator.machine.arm.moves_started == 0


def test_the_pendant_moves_nothing_outside_teach():
    with pytest.raises(ConfigError, match="Teach"):
        EpsonSimulator().world.operator.jog_onto_pin()


def test_another_nozzle_changes_the_truth_and_not_what_is_stored():
    simulator = EpsonSimulator()
    before = simulator.world.tips[1]
    after = simulator.world.change_nozzle()
    assert simulator.world.tips[1] == after != before
    assert simulator.machine.tools.get(1) == STORED


def test_what_is_looked_at_does_not_depend_on_the_tool_in_force():
    simulator = EpsonSimulator()
    seen = simulator.world.operator.look()
    simulator.machine.tools.select(0)
    assert simulator.world.operator.look() == seen


def test_a_tool_without_a_nozzle_is_the_flange():
    simulator = EpsonSimulator()
    flange = simulator.machine.arm.flange()
    assert simulator.world.tip_mm(7) == pytest.approx((flange.x_mm, flange.y_mm, flange.z_mm))


def test_the_truth_is_plain_json():
    truth = EpsonSimulator(seed=2).world.truth()
    assert ToolOffset(**truth["stored"]["1"]) == STORED
    assert truth["selected_tool"] == 1
    assert len(truth["pin_mm"]) == 3


# A simulated person's errors, on both kinds of robots.

KINDS = {"epson": EpsonSimulator, "softmotion": SoftMotionSimulator}
HOSTS = {"epson": in_process, "softmotion": plc_in_process}
ANYWHERE = WorkBox(-2000, 2000, -2000, 2000, -2000, 2000)
SURE = {"eye_sigma_mm": 0.0}


@pytest.fixture(params=KINDS)
def make(request):
    """Makes a cell of each kind whose person may jog and sees without error."""

    def cell(**parameters):
        world = WorldParameters(**{**SURE, **parameters})
        simulator = KINDS[request.param](seed=2, world=world)
        simulator.world.operator._require_jogging = lambda: None
        return simulator

    return cell


@contextmanager
def connected(simulator):
    """Yield a controller on the simulator, in simulated time."""
    kind = "epson" if isinstance(simulator, EpsonSimulator) else "softmotion"
    host, name = HOSTS[kind], f"habits-{kind}"
    try:
        with robolink.connect(host.register(name, simulator)) as controller:
            controller.motors(True)
            controller.tools.select(0)
            yield controller
    finally:
        host.unregister(name)


def lifted(simulator, by_mm=(0.7, -0.4, 3.0)):
    """Let the program lift the tip off the pin and beside it."""
    world = simulator.world
    world.robot.carry(world.tips[1], by_mm)


def miss(simulator):
    """Return the tip's distance beside the pin, and above it."""
    dx, dy, dz = simulator.world.gap_mm()
    return -dx, -dy, -dz


def touched(simulator, count):
    """Touch this often, with lifts between; return the tip's place each time."""
    misses = []
    for _ in range(count):
        lifted(simulator)
        simulator.world.operator.jog_onto_pin()
        misses.append(miss(simulator))
    return misses


def test_a_person_without_habits_ends_on_the_pin(make):
    simulator = make()
    for seen in touched(simulator, 3):
        assert seen == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert simulator.world.operator.touches == 3


def test_who_only_presses_enter_leaves_the_robot_where_it_is(make):
    simulator = make(person_stays_share=1.0, person_stays_from_touch=3)
    ends = touched(simulator, 5)
    assert [math.hypot(*at[:2]) < 1e-6 for at in ends] == [True, True, False, False, False]
    for before, after in pairwise(ends[2:]):
        assert after[0] - before[0] == pytest.approx(0.7, abs=1e-6)
    before = simulator.world.robot.placement()
    assert simulator.world.operator.look() == type(simulator.world.operator.look())(0, 0, 0)
    assert simulator.world.robot.placement() == before


def test_a_share_of_the_touches_is_left_out_and_the_seed_decides_which(make):
    def course():
        simulator = make(person_stays_share=0.3)
        return [math.hypot(*at) > 0.1 for at in touched(simulator, 60)]

    stayed = course()
    assert stayed == course()
    assert 8 <= sum(stayed) <= 30


def test_a_bias_in_the_base_stays_there_and_one_in_the_tool_turns_with_it(make):
    for frame, turns in (("base", False), ("tool", True)):
        simulator = make(person_bias_mm=0.2, person_bias_frame=frame, person_bias_toward_deg=90.0)
        before = touched(simulator, 1)[0]
        simulator.world.robot.turn(-40.0)
        after = touched(simulator, 1)[0]
        assert math.hypot(*before[:2]) == pytest.approx(0.2)
        assert math.hypot(*after[:2]) == pytest.approx(0.2)
        turned = math.degrees(math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]))
        assert math.remainder(turned, 360.0) == pytest.approx(-40.0 if turns else 0.0, abs=1e-6)


def test_a_bias_along_the_approach_stops_short_on_the_side_the_tip_came_from(make):
    simulator = make(person_bias_mm=0.05, person_bias_frame="approach")
    touched(simulator, 1)
    for x_mm, y_mm in ((1.0, 0.0), (0.0, -1.0), (-0.6, 0.8)):
        pin, tip = simulator.world.pin_mm, simulator.world.tip_mm()
        to_pin = (pin[0] - tip[0], pin[1] - tip[1], pin[2] - tip[2])
        beside = (to_pin[0] + x_mm, to_pin[1] + y_mm, to_pin[2] + 2.0)
        lifted(simulator, beside)
        simulator.world.operator.jog_onto_pin()
        assert miss(simulator) == pytest.approx((0.05 * x_mm, 0.05 * y_mm, 0.0), abs=1e-6)


def test_who_tires_wanders_farther_the_longer_it_lasts(make):
    ends = touched(make(person_tires_mm=0.02), 200)
    assert ends[0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    steps = [after[axis] - before[axis] for before, after in pairwise(ends) for axis in (0, 1)]
    assert math.sqrt(fmean(step**2 for step in steps)) == pytest.approx(0.02, rel=0.15)
    assert fmean(math.hypot(*at[:2]) for at in ends[100:]) > 0.05
    assert all(abs(at[2]) < 1e-6 for at in ends)


def test_a_pin_is_bumped_once_after_the_touch_that_was_named(make):
    simulator = make(pin_bumped_after_touch=2, pin_bump_mm=0.3, pin_bump_toward_deg=90.0)
    first = simulator.world.pin_mm
    pins = []
    for _ in range(5):
        touched(simulator, 1)
        pins.append(simulator.world.pin_mm)
    moved = [math.dist(pin, first) for pin in pins]
    assert moved == pytest.approx([0.0, 0.0, 0.3, 0.3, 0.3])
    assert pins[-1] == pytest.approx((first[0], first[1] + 0.3, first[2]))


def test_who_presses_ends_deeper_and_who_mistakes_the_angle_turned(make):
    simulator = make(person_presses_mm=0.1, person_angle_error_deg=0.5)
    turns = []
    for _ in range(6):
        before = simulator.world.robot.flange().u_deg
        assert touched(simulator, 1)[0] == pytest.approx((0.0, 0.0, -0.1), abs=1e-6)
        turns.append(simulator.world.robot.flange().u_deg - before)
    assert all(abs(turn) == pytest.approx(0.5) for turn in turns)
    assert len({turn > 0 for turn in turns}) == 2


def test_habits_go_together(make):
    simulator = make(
        person_bias_mm=0.1,
        person_presses_mm=0.05,
        pin_bumped_after_touch=1,
        pin_bump_mm=0.2,
        person_stays_share=1.0,
        person_stays_from_touch=3,
    )
    first, second, third = touched(simulator, 3)
    assert first == pytest.approx((0.1, 0.0, -0.05), abs=1e-6)
    assert second == pytest.approx((0.1, 0.0, -0.05), abs=1e-6)
    assert third[2] == pytest.approx(2.95, abs=1e-6)


def test_other_habits_begin_a_new_count_and_other_imperfections_do_not(make):
    simulator = make(person_presses_mm=0.1)
    touched(simulator, 2)
    perform(simulator, {"do": "set_world", "camera_noise_px": 0.3})
    assert perform(simulator, {"do": "counters"})["touches"] == 2
    perform(simulator, {"do": "set_world", "person_stays_share": 1, "person_bias_frame": "tool"})
    assert perform(simulator, {"do": "counters"})["touches"] == 0
    assert simulator.world.parameters.person_bias_frame == "tool"


@pytest.mark.parametrize(
    ("name", "value"),
    [("person_stays_share", 1.5), ("person_bias_frame", "moon"), ("person_presses_mm", -1)],
)
def test_habits_that_nobody_can_have_are_refused(make, name, value):
    with pytest.raises(ConfigError):
        perform(make(), {"do": "set_world", name: value})


def asked_touch(simulator, controller, said=None):
    """Have the person bring the tip onto the pin, as a procedure does; return the seconds."""
    eyes, before_ns = InProcessEyes(simulator), controller.clock.now_ns()
    operator = _operator.AssistedOperator.with_eyes(
        eyes, (said if said is not None else []).append, clock=controller.clock
    )
    runner = Runner(controller, controller.groups[0], operator, RunSettings(box=ANYWHERE))
    runner.run(ask_for_pose("Jog the tip onto the pin."))
    return (controller.clock.now_ns() - before_ns) / 1e9


def test_a_person_who_is_asked_thinks_and_jogs_onto_the_pin(make):
    simulator = make()
    with connected(simulator) as controller:
        assert asked_touch(simulator, controller) > 1.0
        assert miss(simulator) == pytest.approx((0.0, 0.0, 0.0), abs=0.025)
        assert simulator.world.operator.touches == 1


def test_who_is_asked_and_only_presses_enter_does_so_each_time(make):
    simulator = make(person_stays_share=1.0)
    with connected(simulator) as controller:
        before = simulator.world.robot.placement()
        for _ in range(2):
            assert 1.0 <= asked_touch(simulator, controller) < 1.5
        assert simulator.world.robot.placement() == before
        assert simulator.world.operator.touches == 1  # nothing moved: one touch, asked for twice


def test_an_answer_that_was_typed_ahead_is_there_at_once_and_looked_for_when_asked_again(make):
    simulator = make(person_types_ahead=True)
    with connected(simulator) as controller:
        for touch in (1, 2):
            before = simulator.world.robot.placement()
            assert asked_touch(simulator, controller) < 0.3
            assert simulator.world.robot.placement() == before
            assert asked_touch(simulator, controller) > 1.0
            assert miss(simulator) == pytest.approx((0.0, 0.0, 0.0), abs=0.025)
            assert simulator.world.operator.touches == touch
            lifted(simulator)


def test_a_mistaken_angle_is_jogged_before_the_steps_to_the_pin(make):
    simulator = make(person_angle_error_deg=0.5)
    with connected(simulator) as controller:
        before, said = simulator.world.robot.flange().u_deg, list[str]()
        asked_touch(simulator, controller, said)
        turned = simulator.world.robot.flange().u_deg - before
        assert abs(turned) == pytest.approx(0.5, abs=0.002)
        assert miss(simulator) == pytest.approx((0.0, 0.0, 0.0), abs=0.025)
        steps = [line for line in said if "operator:" in line]
        assert "u" in steps[0].split(":")[1]


def test_a_served_person_has_the_same_habits_and_thinks_at_the_pace_of_the_simulation(make):
    simulator = make(person_stays_share=1.0, person_thinks_s=20.0)
    with (
        serve_assist(simulator, clock=ScaledClock(20.0)) as host,
        AssistClient(host.url) as eyes,
    ):
        manner = eyes.be_asked(touch=True, tool=1)
        assert (manner.touch, manner.stays) == (1, True)
        assert manner.thinks_s == pytest.approx(1.0)
        assert eyes.be_asked(touch=False, tool=1).touch == 0
        assert eyes.do("counters")["touches"] == 1
        for thinks_s, really_s in ((1.0, LEAST_THINKING_S), (0.1, 0.1), (0.0, 0.0)):
            eyes.do("set_world", person_thinks_s=thinks_s)
            assert eyes.be_asked(touch=False, tool=1).thinks_s == really_s


def test_other_questions_are_answered_whatever_the_habit_and_begin_no_touch(make):
    simulator = make(person_stays_share=1.0)
    operator = _operator.AssistedOperator.with_eyes(InProcessEyes(simulator), lambda _: None)
    operator.ask("Write it?", Question.YES_NO)
    assert operator.poll(0.0) == "y"
    assert simulator.world.operator.touches == 0


def test_habits_leave_the_scatter_of_the_eye_as_it_is(make):
    plain, biased = make(eye_sigma_mm=0.05), make(eye_sigma_mm=0.05, person_presses_mm=0.1)
    for one, other in zip(touched(plain, 4), touched(biased, 4), strict=True):
        assert replace_z(other, other[2] + 0.1) == pytest.approx(one, abs=1e-6)


def replace_z(at, z_mm):
    """Return a place at another height."""
    return (at[0], at[1], z_mm)
