"""The simulated arm, and the machine that moves it."""

import math
import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson.arm.arm import Arm, rest_of
from robolink_simulators.epson.arm.coordinate_systems import Local
from robolink_simulators.epson.arm.kinematics import forward, tip_of
from robolink_simulators.epson.arm.motion_parameters import MotionParameters
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.arm.trajectory import JointPace, LinePace, Ramp
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.memory.points import Point

from robolink.model import Hand, Pose, ToolOffset
from tests._rows import each_row

S = 1_000_000_000
T6 = find_robot("T6-602S")
REST = rest_of(T6)
FAST = JointPace(100.0)
LINE = LinePace(100.0, 1000.0, 1000.0, 50.0, 200.0)
NOZZLE = ToolOffset(80.0, -30.0, -20.0, 15.0)
ELSEWHERE = Joints(60.0, 80.0, -40.0, -200.0)

rates = st.floats(1e-3, 1e3)


def going(target=ELSEWHERE, pace=FAST, **habits):
    arm = Arm(T6, **habits)
    end_ns = arm.start([arm.plan_go(target, pace)], 0)
    return arm, end_ns


@settings(max_examples=100, deadline=None)
@given(rates, rates, rates)
def test_a_ramp_keeps_its_limits_and_arrives(rate, rise, fall):
    ramp = Ramp.fastest(rate, rise, fall)
    assert ramp.peak_per_s <= rate * (1 + 1e-9)
    assert ramp.share_at(0) == 0
    assert ramp.share_at(ramp.duration_s) == 1
    times = [ramp.duration_s * step / 50 for step in range(51)]
    shares = [ramp.share_at(time) for time in times]
    assert all(b >= a - 1e-9 for a, b in pairwise(shares))
    assert ramp.share_at(ramp.duration_s * (1 - 1e-9)) == pytest.approx(1, abs=1e-6)
    assert ramp.share_at(ramp.rise_s) == pytest.approx(ramp.peak_per_s * ramp.rise_s / 2)


def test_a_go_ends_exactly_at_its_target_at_the_instant_it_said():
    arm, end_ns = going()
    assert arm.next_change() == end_ns
    arm.advance(end_ns - 1)
    assert arm.moving
    arm.advance(end_ns)
    assert arm.joints == ELSEWHERE
    assert not arm.moving
    assert arm.next_change() is None


def test_all_joints_of_a_go_are_equally_far_along():
    arm, end_ns = going()
    halfway = arm.position_at(end_ns // 3)
    pairs = zip(REST, halfway, ELSEWHERE, strict=True)
    shares = [(now - start) / (end - start) for start, now, end in pairs]
    assert shares == pytest.approx([shares[0]] * 4)
    assert 0 < shares[0] < 1


def test_half_the_speed_takes_longer_and_no_joint_exceeds_its_top_speed():
    _, fast_ns = going()
    _, slow_ns = going(pace=JointPace(50.0))
    assert slow_ns > fast_ns
    arm, end_ns = going()
    step = end_ns // 400
    for start in range(0, end_ns, step):
        before, after = arm.position_at(start), arm.position_at(start + step)
        speeds = [abs(b - a) / step * S for a, b in zip(before, after, strict=True)]
        assert all(v <= top * 1.001 for v, top in zip(speeds, T6.top_speed, strict=True))


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(*(st.floats(*travel) for travel in T6.ranges)),
    st.sampled_from([None, NOZZLE]),
)
def test_in_low_power_no_joint_motion_carries_the_tip_faster_than_250_mm_s(values, offset):
    arm = Arm(T6)
    pace = JointPace(100.0, tip_limit_mm_s=250.0)
    radius_mm = 0.0 if offset is None else math.hypot(offset.x_mm, offset.y_mm)
    end_ns = arm.start([arm.plan_go(Joints(*values), pace, radius_mm=radius_mm)], 0)
    places = [
        tip_of(T6, forward(T6, arm.position_at(end_ns * step // 100)), offset).coordinates()[:3]
        for step in range(101)
    ]
    longest = max(math.dist(a, b) for a, b in pairwise(places))
    assert longest <= 250.0 * end_ns / 100 / S + 1e-6


def test_in_low_power_speeds_are_held_to_the_defaults_and_lines_to_250_mm_s():
    parameters = MotionParameters(speed=(100,) * 3, accel=(100,) * 6, speed_s=(900.0,) * 3)
    low = parameters.joint_pace(power_high=False)
    assert (low.speed_percent, low.accel_percent, low.tip_limit_mm_s) == (5, 10, 250.0)
    assert parameters.joint_pace(power_high=True).speed_percent == 100
    assert parameters.line_pace(power_high=False).speed_mm_s == 250.0
    assert parameters.line_pace(power_high=True).speed_mm_s == 900.0


def test_a_move_carries_the_tip_along_a_straight_line_turning_evenly():
    arm = Arm(T6)
    start = tip_of(T6, arm.flange(), NOZZLE)
    target = Pose(start.x_mm - 60, start.y_mm - 30, start.z_mm - 12, start.u_deg + 30)
    end_ns = arm.start([arm.plan_move(target, LINE, offset=NOZZLE)], 0)
    for step in range(11):
        arm.advance(end_ns * step // 10)
        tip = tip_of(T6, arm.flange(), NOZZLE)
        share = (start.x_mm - tip.x_mm) / 60
        assert tip.y_mm == pytest.approx(start.y_mm - 30 * share, abs=1e-6)
        assert tip.z_mm == pytest.approx(start.z_mm - 12 * share, abs=1e-6)
        assert tip.u_deg == pytest.approx(start.u_deg + 30 * share, abs=1e-6)
    assert share == pytest.approx(1)


def test_a_move_takes_as_long_as_its_speed_and_acceleration_say():
    arm = Arm(T6)
    start = arm.flange()
    leg = arm.plan_move(Pose(start.x_mm, start.y_mm - 100, start.z_mm, start.u_deg), LINE)
    # 0.1 s to reach 100 mm/s, 0.1 s to stop: 5 mm each; 90 mm at speed.
    assert leg.duration_ns == pytest.approx(1.1 * S)


def test_a_turn_about_the_tip_leaves_the_tip_where_it_is():
    arm = Arm(T6)
    start = tip_of(T6, arm.flange(), NOZZLE)
    target = Pose(start.x_mm, start.y_mm, start.z_mm, start.u_deg + 90)
    end_ns = arm.start([arm.plan_move(target, LINE, offset=NOZZLE)], 0)
    arm.advance(end_ns // 2)
    tip = tip_of(T6, arm.flange(), NOZZLE)
    assert tip.coordinates()[:3] == pytest.approx(start.coordinates()[:3], abs=1e-6)
    assert start.u_deg < tip.u_deg < target.u_deg


def test_a_line_through_an_unreachable_region_is_refused_before_it_starts():
    arm = Arm(T6, Joints(-30.0, 60.0, 0.0, 0.0))
    flange = arm.flange()
    with pytest.raises(OutOfReach):
        arm.plan_move(Pose(-flange.x_mm, flange.y_mm, 0, 0), LINE)
    assert arm.moves_started == 0


def test_a_line_cannot_change_the_hand():
    arm = Arm(T6)
    with pytest.raises(SpelRefusal, match="hand"):
        arm.plan_move(Pose(300, 300, 0, 0, hand=Hand.LEFT), LINE)


def test_a_halted_arm_stays_where_it_was_at_that_instant():
    arm, end_ns = going()
    expected = arm.position_at(end_ns // 2)
    arm.halt(end_ns // 2)
    arm.advance(end_ns * 2)
    assert arm.joints == expected != ELSEWHERE
    assert not arm.moving


def test_each_motion_counts_once_however_many_legs_it_has():
    arm = Arm(T6)
    up = Joints(45.0, 60.0, -10.0, -105.0)
    legs = [arm.plan_go(up, FAST), arm.plan_go(ELSEWHERE, FAST)]
    arm.start(legs, 0)
    assert arm.moves_started == 1
    arm.place(REST, 0)
    assert arm.moves_started == 1


def test_the_measured_position_scatters_in_the_lengths_with_the_noise_asked_for():
    arm, rng = Arm(T6), random.Random(7)
    flange = arm.flange()
    shots = [arm.real_position(rng, 0.002) for _ in range(400)]
    errors = [shot.x_mm - flange.x_mm for shot in shots]
    sigma = math.sqrt(sum(error**2 for error in errors) / len(errors))
    assert sigma == pytest.approx(0.002, rel=0.2)
    assert all(shot.u_deg == flange.u_deg for shot in shots)


def test_without_noise_the_measured_position_is_the_commanded_one():
    arm = Arm(T6, backlash_deg=0.1)
    assert arm.real_position(random.Random(1), 0.0) == arm.flange()


def test_backlash_trails_the_way_each_joint_turned_last():
    arm, end_ns = going(backlash_deg=0.02)
    arm.advance(end_ns)
    # J1 and J2 went up, J4 down, J3 has no play.
    assert arm.true_joints == pytest.approx((59.99, 79.99, -40.0, -199.99))


def test_backlash_does_not_depend_on_how_often_the_arm_is_looked_at():
    out = Joints(70.0, 60.0, 0.0, -105.0)
    back = Joints(65.0, 60.0, -5.0, -105.0)
    seen = []
    for steps in (1, 57):
        arm = Arm(T6, backlash_deg=0.02)
        first = arm.plan_go(out, FAST)
        arm.start([first], 0)
        arm.advance(first.duration_ns)
        second = arm.plan_go(back, FAST)
        end_ns = arm.start([first, second], first.duration_ns)
        for step in range(1, steps + 1):
            arm.advance(first.duration_ns + (end_ns - first.duration_ns) * step // steps)
        seen.append(arm.true_joints)
    assert seen[0] == seen[1]
    assert seen[0][0] == pytest.approx(65.01)


def test_an_arm_cannot_be_placed_outside_its_ranges():
    arm = Arm(T6)
    with pytest.raises(OutOfReach):
        arm.place(Joints(0.0, 0.0, 5.0, 0.0), 0)
    assert arm.joints == REST


ARM_NOZZLE = ToolOffset(12.0, -3.0, -20.0, 30.0)


@pytest.fixture
def machine():
    return Machine(T6)


def test_the_selected_tool_moves_the_reported_tip_but_not_the_arm(machine):
    flange = machine.tip()
    machine.tools.set(2, ARM_NOZZLE)
    machine.tools.select(2)
    tip = machine.tip()
    # The arm rests with U = 0, so the offset adds up axis by axis.
    added = [a - b for a, b in zip(tip.coordinates(), flange.coordinates(), strict=True)]
    assert added == pytest.approx(ARM_NOZZLE.components())
    assert tip.tool == 2
    assert machine.arm.moves_started == 0


def test_the_joints_for_a_point_bring_the_selected_tip_there(machine):
    machine.tools.set(2, ARM_NOZZLE)
    machine.tools.select(2)
    machine.locals.define(1, Local(10.0, 20.0, -5.0, 30.0))
    target = machine.locals.convert(Point((200.0, 380.0, -60.0, 25.0, 0.0, 0.0)), 1)
    machine.arm.place(machine.robot.joints_for(target), 0)
    assert machine.tip().coordinates() == pytest.approx((200.0, 380.0, -60.0, 25.0, 0.0, 0.0))


def test_an_undefined_tool_cannot_be_selected(machine):
    with pytest.raises(SpelRefusal) as refused:
        machine.tools.select(5)
    assert refused.value.kind is RefusalKind.TOOL_UNDEFINED
    assert machine.tools.selected == 0


@pytest.mark.parametrize(
    ("tool", "kind"),
    [
        (0, RefusalKind.TOOL_ZERO_FIXED),
        (16, RefusalKind.TOOL_NUMBER),
        (-1, RefusalKind.TOOL_NUMBER),
    ],
)
def test_only_tools_1_to_15_can_be_written(machine, tool, kind):
    for write in (lambda: machine.tools.set(tool, ARM_NOZZLE), lambda: machine.tools.clear(tool)):
        with pytest.raises(SpelRefusal) as refused:
            write()
        assert refused.value.kind is kind
    assert machine.flash_writes == 0


def test_every_write_and_clear_wears_the_flash(machine):
    machine.tools.set(1, ARM_NOZZLE)
    machine.tools.set(1, ARM_NOZZLE)
    machine.tools.clear(1)
    machine.tools.select(0)
    assert machine.flash_writes == 3


def test_clearing_the_tool_in_force_is_an_error_or_selects_the_flange(machine):
    machine.tools.set(1, ARM_NOZZLE)
    machine.tools.select(1)
    with pytest.raises(SpelRefusal) as refused:
        machine.tools.clear(1)
    assert refused.value.kind is RefusalKind.TOOL_IN_FORCE
    assert (machine.tools.selected, machine.tools.get(1)) == (1, ARM_NOZZLE)
    machine.tools.clear(1, in_force="selects_zero")
    assert machine.tools.selected == 0


def test_motor_on_resets_the_motion_parameters_and_power(machine):
    machine.parameters = MotionParameters(speed=(50, 50, 50), limz_mm=-20.0)
    machine.power_high = True
    machine.switch_motors(True)
    assert machine.motors_on
    assert not machine.power_high
    assert machine.parameters == MotionParameters()


def test_the_measured_tip_is_that_of_the_selected_tool(machine):
    machine.tools.set(1, ARM_NOZZLE)
    machine.tools.select(1)
    assert machine.robot.real_tip(random.Random(1), 0.0) == machine.tip()


def test_a_byte_is_eight_bits_with_the_lowest_first():
    bank = BitBank(16)
    bank.set_byte(1, 0b101)
    assert [bank.get(n) for n in range(8, 12)] == [True, False, True, False]
    bank.set(15, True)
    assert bank.get_byte(1) == 0b1000_0101
    bank.clear()
    assert bank.get_byte(1) == 0


@each_row(
    "use",
    [
        lambda bank: bank.get(16),
        lambda bank: bank.set(-1, True),
        lambda bank: bank.get_byte(2),
        lambda bank: bank.set_byte(0, 256),
    ],
)
def test_a_bit_or_a_value_that_does_not_exist_is_refused(use):
    with pytest.raises(SpelRefusal):
        use(BitBank(16))
