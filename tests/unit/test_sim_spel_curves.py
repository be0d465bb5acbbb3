"""Curves and arches (docs/reference/spel.md 7.1)."""

import json
import math
import random
from itertools import pairwise

import pytest
from robolink_simulators.cell.frames import axis_and_angle, product, subtract, transposed
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.arm.arch import Arch
from robolink_simulators.epson.arm.coordinate_systems import frame_at
from robolink_simulators.epson.arm.curves import (
    CurveFiles,
    CurveSwitch,
    FreeCurve,
    smooth_course_through,
    through,
)
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.interpreter import Interpreter

from robolink.model import Pose
from tests._rows import each_row
from tests.unit.test_sim_spel_motion import Cell

# Curve stores a free curve, CVMove travels it (docs/reference/spel.md 7.1).

MS = 1_000_000
POINTS = [(200, 400, -40, 0), (250, 420, -45, 20), (300, 380, -50, 10), (320, 300, -40, 0)]


@pytest.fixture
def cell():
    cell = Cell()
    for number, point in enumerate(POINTS, start=1):
        cell.run(f"P{number} = XY({', '.join(map(str, point))})")
    cell.run("Go P1; Power High; SpeedS 200; AccelS 2000")
    return cell


def way(cell, statement):
    """Return the tips of a motion every 2 ms, and the bits switched during it."""
    execution, tips = cell.start(statement), [cell.tip()]
    while not execution.done:
        cell.now_ns += 2 * MS
        execution.advance(cell.now_ns)
        cell.machine.timed_bits.advance(cell.now_ns)
        tips.append((*cell.tip(), cell.machine.outputs.get(5)))
    assert execution.error is None, execution.error
    return tips


def nearest(tips, place):
    return min(math.dist(tip[: len(place)], place) for tip in tips)


def test_a_curve_goes_smoothly_through_its_points_at_speed_s(cell):
    cell.run('Curve "My", O, 0, 4, P1, P2, On 5, P(3:4)')
    tips = way(cell, 'CVMove "MY"')
    assert cell.tip() == pytest.approx(POINTS[-1], abs=1e-9)
    # In 2 ms it moves 0.4 mm.
    assert all(nearest(tips, point) < 0.5 for point in POINTS)
    steps = [math.dist(a[:3], b[:3]) for a, b in pairwise(tips)]
    assert max(steps) == pytest.approx(0.4, abs=0.02)
    # It does not stop at the points between, and does not turn there: no chord of 20 ms bends.
    middle = range(200, len(tips) - 200, 10)
    assert min(steps[200:-200]) > 0.38
    assert all(_bend_deg(tips[i - 10], tips[i], tips[i + 10]) < 12 for i in middle)
    on = next(tip for tip in tips[1:] if tip[4])
    assert math.dist(on[:3], POINTS[1][:3]) < 0.5


def _bend_deg(a, b, c):
    before, after = (math.atan2(q[1] - p[1], q[0] - p[0]) for p, q in ((a, b), (b, c)))
    return abs(math.degrees((after - before + math.pi) % (2 * math.pi) - math.pi))


def test_a_curve_is_the_same_backwards():
    places = [(float(x), float(y), float(z), float(u)) for x, y, z, u in POINTS]
    there, back = through(places, closed=False), through(places[::-1], closed=False)
    for share in (0.1, 0.3, 0.5, 0.8):
        assert there.at(share) == pytest.approx(back.at(1 - share), abs=1e-6)


def test_a_closed_curve_ends_where_it_began(cell):
    cell.run('Curve "ring", C, 0, 3, P1, P2, P3')
    tips = way(cell, 'CVMove "ring"')
    assert cell.tip() == pytest.approx(POINTS[0], abs=1e-9)
    assert nearest(tips, POINTS[2][:3]) < 0.5
    assert {round(tip[3], 6) for tip in tips} == {0.0}


def test_axes_that_a_curve_does_not_rule_stay(cell):
    cell.run('Curve "flat", O, 0, 2, P1, P2, P3; Go P1 -Z(10) +U(7)')
    tips = way(cell, 'CVMove "flat"')
    assert {(round(tip[2], 6), round(tip[3], 6)) for tip in tips} == {(-50.0, 7.0)}
    assert cell.tip()[:2] == pytest.approx(POINTS[2][:2], abs=1e-9)


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ('Curve "c", O, 0, 4, P1, P2', 4002),
        ('Curve "c", O, 0, 5, P1, P2, P3', 4002),
        ('Curve "c", O, 0, 6, P1, P2, P3', 4002),
        ('Curve "c", O, 16, 4, P1, P2, P3', 2232),
        ('Curve "c", O, 1, 4, P1, P2, P3', 2199),
        ('Curve "c", O, 256, 4, P1, P2, P3', 4002),
        ('Curve "c", O, 0.5, 4, P1, P2, P3', 4002),
        ('Curve "c", X, 0, 4, P1, P2, P3', 2100),
        ('Curve "c", O, 0, 4, P1, P1, P3', 4002),
        ('Curve "c", O, 0, 4, P1, P2, P3 /L', 4001),
        ('Curve "c", O, 0, 4, P1, P2, P77', 7007),
        ("Curve P1, O, 0, 4, P1, P2, P3", 2100),
        ('CVMove "c", P1', 2100),
    ],
)
def test_what_is_no_curve_is_refused_and_nothing_is_stored(cell, statement, number):
    before, started = cell.machine.kept.to_state(), cell.machine.arm.moves_started
    assert cell.start(statement).error.number == number
    assert cell.machine.kept.to_state() == before
    assert cell.machine.arm.moves_started == started


def test_from_elsewhere_nothing_moves_and_nothing_switches(cell):
    cell.run('Curve "my", O, 0, 4, P1, On 5, P2, P3; Go P2')
    started = cell.machine.arm.moves_started
    assert cell.start('CVMove "my"').error.number == 2199
    assert cell.start('CVMove "yours"').error is not None
    cell.run('Go P1; Curve "odd", O, 0, 4, P1, On 5, P2, On 99999, P3')
    started += 1
    assert cell.start('CVMove "odd"').error.number == 2344
    assert cell.machine.arm.moves_started == started
    assert cell.machine.timed_bits.next_change() is None


def test_a_point_outside_of_the_limits_or_out_of_reach_is_refused_first(cell):
    cell.run('Curve "my", O, 0, 4, P1, P2, P3; XYLim 0, 600, 0, 410')
    assert cell.start('CVMove "my"').error.number == 4001
    cell.run('XYLimClr; Curve "far", O, 0, 4, P1, XY(500, 500, -40, 0), P3')
    assert cell.start('CVMove "far"').error.number == 4001


def test_a_curve_outlives_a_power_cycle(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    places = ((1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0), (9.0, 8.0, 7.0, 6.0))
    curve = FreeCurve(4, places, (CurveSwitch(1, "on", 5),))
    first.machine.kept.curves.store("My", curve)
    first.advance(1)
    assert EpsonSimulator(state_path=kept).machine.kept.curves.get("mY") == curve


@pytest.mark.parametrize(("kind", "turns_deg"), [("C", 360), ("O", 270)])
def test_the_tool_follows_the_direction_of_a_curve_of_mode_2(cell, kind, turns_deg):
    for number in range(8):
        angle = math.tau * number / 8
        x, y = 240 + 20 * math.cos(angle), 380 + 20 * math.sin(angle)
        cell.run(f"P{number} = XY({x}, {y}, -40, {50 * number})")
    cell.run(f'Go P0; Curve "edge", {kind}, 2, 4, P(0:7)')
    tips = way(cell, 'CVMove "edge"')
    assert tips[0][3] == pytest.approx(0)
    # An open one ends one eighth earlier, and its first and last direction are those of chords.
    assert cell.tip()[3] == pytest.approx(turns_deg, abs=25)
    headings = [math.degrees(math.atan2(b[1] - a[1], b[0] - a[0])) for a, b in pairwise(tips)]
    middle = range(len(tips) // 4, 3 * len(tips) // 4)
    off = [
        (headings[i] - headings[20] - tips[i][3] + tips[20][3] + 180) % 360 - 180 for i in middle
    ]
    assert max(map(abs, off)) < 8


# Curve on six axes and past an external control point (docs/reference/spel.md 7.1).


def six_axes():
    cell = Cell()
    cell.machine = Machine(find_robot("C8-C901S"), joints=Joints(0, -35, 5, 0, -60, 0))
    cell.machine.switch_motors(True)
    cell.interpreter = Interpreter(cell.machine, EpsonOptions(), random.Random(1))
    cell.run("TLSet 1, XY(0, 30, 80, 0, 20, 0); Tool 1; P1 = Here")
    cell.run("P2 = P1 +X(25) +Y(20) +TLW(12); P3 = P1 +X(40) +Y(-10) +TLV(15)")
    return cell


def four_axes():
    cell = Cell()
    cell.run("P1 = XY(200, 400, -40, 0); P2 = XY(230, 420, -45, 20); P3 = XY(270, 420, -50, 35)")
    return cell


def frames_on_the_way(cell, statement):
    """Return the frames of the tip every 2 ms of a motion, and the ms at which output 5 is on."""
    cell.run("Go P1; Power High; SpeedS 100; AccelS 1000")
    execution = cell.start(statement)
    frames, lit = [frame_of(cell.machine.tip())], []
    while not execution.done:
        cell.now_ns += 2 * MS
        execution.advance(cell.now_ns)
        cell.machine.timed_bits.advance(cell.now_ns)
        frames.append(frame_of(cell.machine.tip()))
        lit += [len(frames) - 1] * cell.machine.outputs.get(5)
    assert execution.error is None, execution.error
    return frames, lit


def turn_deg(a, b):
    return axis_and_angle(product(a.rotation, transposed(b.rotation)))[1]


def point(cell, number):
    return frame_at(cell.machine.points.get(number).coordinates)


def off(frame, other):
    return math.dist(frame.shift_mm, other.shift_mm) + turn_deg(frame, other)


def test_six_axes_pass_their_points_in_place_and_orientation_without_a_halt():
    cell = six_axes()
    cell.run('Curve "lean", O, 0, 6, P1, P2, On 5, P3')
    frames, lit = frames_on_the_way(cell, 'CVMove "lean"')
    # In 2 ms the tip goes 0.2 mm, and turns little.
    assert min(off(frame, point(cell, 2)) for frame in frames) < 0.3
    assert off(frames[-1], point(cell, 3)) < 1e-3
    assert off(frames[lit[0]], point(cell, 2)) < 0.6
    steps = [math.dist(a.shift_mm, b.shift_mm) for a, b in pairwise(frames)]
    assert max(steps) == pytest.approx(0.2, abs=0.01)
    assert min(steps[80:-80]) > 0.19
    # Nor does the tool stop turning, or jump, at the point between.
    turns = [turn_deg(a, b) for a, b in pairwise(frames)]
    assert max(abs(b - a) for a, b in pairwise(turns[80:-80])) < 0.02


def test_a_closed_curve_on_six_axes_ends_as_it_began():
    cell = six_axes()
    cell.run('Curve "ring", C, 0, 6, P1, P2, P3')
    frames, _ = frames_on_the_way(cell, 'CVMove "ring"')
    assert off(frames[-1], point(cell, 1)) < 1e-3
    assert min(off(frame, point(cell, 3)) for frame in frames) < 0.3


@pytest.mark.parametrize(("kind", "least", "most"), [("O", 170, 245), ("C", 335, 365)])
def test_the_tool_of_six_axes_keeps_its_angle_to_the_way_in_the_plane(kind, least, most):
    """Help on Curve: tangential correction takes U from the first point alone."""
    cell = six_axes()
    for n in range(6):
        along, across = (30 * f(math.tau * n / 6) for f in (math.cos, math.sin))
        cell.run(f"P{10 + n} = P1 +X({along - 30}) +Y({across}) +Z({n % 2}) +U({n})")
    cell.run(f'Curve "cut", {kind}, 2, 6, P(10:{15 if kind == "C" else 14})')
    frames, _ = frames_on_the_way(cell, 'CVMove "cut"')
    first, spread = point(cell, 1).rotation, []
    for before, after in list(pairwise(frames))[80:-80]:
        dx, dy, _ = subtract(after.shift_mm, before.shift_mm)
        axis, angle = axis_and_angle(product(after.rotation, transposed(first)))
        assert abs(axis[2]) > 0.999
        turned_deg = angle * math.copysign(1, axis[2])
        spread.append((turned_deg - math.degrees(math.atan2(dy, dx))) % 360)
    # A span is twenty straight pieces of 3 degrees each.
    assert max(spread) - min(spread) < 6
    # An open way begins and ends along its chords.
    assert least < sum(turn_deg(a, b) for a, b in pairwise(frames)) < most


def test_a_tool_that_turns_right_round_turns_evenly_over_the_seam():
    cell = six_axes()
    x, y, z = point(cell, 1).shift_mm
    tips = [
        Pose(x + 30 * math.cos(angle), y + 30 * math.sin(angle), z, math.degrees(angle), 10, 170)
        for angle in (math.tau * n / 5 for n in (0, 1, 2, 3, 4, 5))
    ]
    way = smooth_course_through(cell.machine.model, tips, point=None, closed=True)
    turns = [b[3] - a[3] for a, b in pairwise(way.places)]
    assert sum(turns) == pytest.approx(360)
    assert max(turns) < 1.2 * min(turns)
    # Each angle is interpolated by itself: one that no point changes stays.
    assert all(place[4:] == pytest.approx((10, 170)) for place in way.places)


@pytest.mark.parametrize("make", [six_axes, four_axes])
def test_past_a_control_point_the_workpiece_sees_it_go_at_speed_s(make):
    cell = make()
    x, y, z = point(cell, 1).shift_mm
    cell.run(f"ECPSet 3, XY({x + 150}, {y - 40}, {z - 30}, 0)")
    axes = 6 if cell.machine.model.six_axes else 4
    cell.run(f'Curve "edge", O, 48, {axes}, P1, P2, On 5, P3')
    frames, lit = frames_on_the_way(cell, 'CVMove "edge"')
    ecp = frame_at(cell.machine.control_points.get(3))
    seen = [(frame.inverse() @ ecp).shift_mm for frame in frames]
    steps = [math.dist(a, b) for a, b in pairwise(seen)]
    assert max(steps) == pytest.approx(0.2, abs=0.01)
    assert min(steps[80:-80]) > 0.19
    # The tip itself takes another path, and still passes the taught places.
    own = [math.dist(a.shift_mm, b.shift_mm) for a, b in pairwise(frames)]
    assert max(abs(a - b) for a, b in zip(own[80:-80], steps[80:-80], strict=True)) > 0.05
    assert min(off(frame, point(cell, 2)) for frame in frames) < 0.5
    assert off(frames[lit[0]], point(cell, 2)) < 1
    assert off(frames[-1], point(cell, 3)) < 1e-3


def test_a_turn_about_the_control_point_alone_is_no_way_past_it():
    cell = four_axes()
    cell.run("ECPSet 1, XY(200, 400, -40, 0)")
    assert cell.start('Curve "c", O, 16, 4, P1, P1 +U(9), P2').error.number == 4002


@each_row(
    ("statement", "number"),
    [
        ('Curve "c", O, 0, 4, P1, P2, P3', 4002),
        ('Curve "c", O, 0, 5, P1, P2, P3', 4002),
        ('Curve "c", O, 18, 6, P1, P2, P3', 2199),
        ('Curve "c", O, 32, 6, P1, P2, P3', 2232),
        ('Curve "c", O, 0, 6, P1, P2, P3 /F', 4001),
        ('Curve "c", O, 0, 6, P1, P2, P2 +TLU(5)', 4002),
        ('CVMove "none"', 7213),
    ],
)
def test_what_six_axes_refuse(statement, number):
    cell = six_axes()
    cell.run("ECPSet 1, P1")
    assert cell.start(statement).error.number == number
    assert cell.machine.arm.moves_started == 0


def test_four_axes_do_not_follow_a_curve_past_a_control_point():
    cell = four_axes()
    cell.run("ECPSet 1, P2")
    assert cell.start('Curve "c", O, 18, 4, P1, P2, P3').error.number == 2199


def test_neither_from_elsewhere_nor_without_the_control_point():
    cell = six_axes()
    cell.run("ECPSet 1, P1 +X(50); Go P1")
    cell.run('Curve "plain", O, 0, 6, P1, P2, P3; Curve "past", O, 16, 6, P1, P2, P3; ECPClr 1')
    started = cell.machine.arm.moves_started
    assert cell.start('CVMove "past"').error.number == 2232
    cell.run("Move P1 +TLU(1) ROT")
    assert cell.start('CVMove "plain"').error.number == 2199
    cell.run('Go P1; XYLim 0, 0, -999, 0; Print "limits"')
    assert cell.start('CVMove "plain"').error.number == 4001
    assert cell.machine.arm.moves_started == started + 2


def test_a_curve_of_six_axes_is_kept_and_no_robot_of_four_takes_it():
    places = tuple((float(n), 2.0, 3.0, 4.0, 5.0, 6.0) for n in range(3))
    files, other = CurveFiles(), CurveFiles()
    files.store("c", FreeCurve(6, places, (CurveSwitch(1, "on", 5),), control_point=3))
    other.restore(json.loads(json.dumps(files.to_state())))
    assert other.get("C") == files.get("c")
    for wrong in ([[1.0, 2.0]] * 3, [[1.0] * 4, [1.0] * 6, [1.0] * 4]):
        with pytest.raises(ValueError, match="four numbers"):
            other.restore({"c": [6, wrong, []]})
    cell = four_axes()
    cell.machine.kept.curves.store("c", files.get("c"))
    assert cell.start('CVMove "c"').error.number == 4028


# Arch, and the corners of a Jump that it rounds (docs/reference/spel.md 7.1).


@pytest.fixture
def cell_for_arches():
    cell = Cell()
    cell.run("Power High; Speed 50; Accel 50, 50; Arch 0, 15, 20")
    return cell


def way_of_arch(cell, statement, *, every_ns=2 * MS):
    """Return the tips of a motion in short steps, from its start to its end."""
    execution, tips = cell.start(statement), [cell.tip()]
    while not execution.done:
        cell.now_ns += every_ns
        execution.advance(cell.now_ns)
        tips.append(cell.tip())
    assert execution.error is None
    return tips


def test_arches_are_listed_as_the_sample_shows_and_asked_for(cell_for_arches):
    lines = cell_for_arches.run("Arch").splitlines()
    assert lines[0] == "arch0 =   15.000   20.000"
    assert lines[6] == "arch6 =   90.000   90.000"
    assert cell_for_arches.run("Print Arch(0, 1), Arch(0, 2), Arch(3, 1)") == "15 20 60\r\n"


@pytest.mark.parametrize(
    "wrong", ["Arch 7, 1, 1", "Arch 0, -1, 1", "Arch 0, 1", "Print Arch(7, 1)"]
)
def test_an_arch_that_cannot_be_is_refused_and_none_changes(cell_for_arches, wrong):
    before = cell_for_arches.run("Arch")
    assert cell_for_arches.start(wrong).error is not None
    assert cell_for_arches.run("Arch") == before


def test_an_arch_stays_straight_at_its_ends_alone(cell_for_arches):
    tips = way_of_arch(cell_for_arches, "Jump XY(200, 420, -70, 50) C0")
    start, end = tips[0], (200, 420, -70, 50)
    assert tips[-1] == pytest.approx(end, abs=1e-9)
    aside = [tip for tip in tips if tip[:2] != start[:2]]
    # The step in which it leaves the straight rise is 2 ms long.
    assert -25 <= aside[0][2] < -20
    below = [tip for tip in tips[len(tips) // 2 :] if tip[2] < -50]
    assert below
    assert all(tip == pytest.approx((*end[:2], tip[2], 50), abs=1e-6) for tip in below)
    rounded = [tip for tip in aside if tip[2] < -1 and abs(tip[0] - 200) > 1]
    assert len(rounded) > 10


def test_an_arch_is_quicker_than_a_gate_and_reaches_the_same_height(cell_for_arches):
    there, back = "Jump XY(200, 420, -70, 50)", "Jump XY(300, 300, -60, 0)"
    cell_for_arches.run(back)
    gate = way_of_arch(cell_for_arches, there)
    cell_for_arches.run(back)
    arch = way_of_arch(cell_for_arches, f"{there} C(0)")
    assert len(arch) < 0.8 * len(gate)
    assert -0.01 < max(tip[2] for tip in arch) <= 1e-9


@pytest.mark.parametrize("arch", ["Arch 0, 41, 5", "Arch 0, 5, 71"])
def test_an_arch_longer_than_the_way_up_or_down_is_a_gate(cell_for_arches, arch):
    cell_for_arches.run(arch)
    tips = way_of_arch(cell_for_arches, "Jump XY(200, 420, -70, 50) C0")
    start = tips[0]
    travelling = [tip for tip in tips if start[0] != tip[0] and abs(tip[0] - 200) > 1e-6]
    assert travelling
    assert all(tip[2] == pytest.approx(0, abs=1e-9) for tip in travelling)


def test_sense_is_looked_at_above_the_target(cell_for_arches):
    cell_for_arches.machine.inputs.set(5, True)
    cell_for_arches.run("Jump XY(200, 420, -70, 50) C0 Sense Sw(5) = On")
    assert cell_for_arches.tip() == pytest.approx((200, 420, 0, 50), abs=1e-6)
    assert cell_for_arches.run("Print JS") == "-1\r\n"


def test_what_runs_beside_an_arch_begins_behind_the_straight_rise(cell_for_arches):
    execution = cell_for_arches.start("Jump XY(200, 420, -70, 50) C0 !D0; On 5!")
    while not cell_for_arches.machine.outputs.get(5):
        cell_for_arches.now_ns = execution.next_change()
        execution.advance(cell_for_arches.now_ns)
    assert cell_for_arches.tip()[2] == pytest.approx(-25, abs=1e-3)


def test_an_arch_that_is_left_comes_to_rest_on_its_way(cell_for_arches):
    execution = cell_for_arches.start("Jump XY(200, 420, -70, 50) C0 Till Sw(5) = On")
    cell_for_arches.now_ns += 200 * MS
    execution.advance(cell_for_arches.now_ns)
    left = cell_for_arches.tip()
    cell_for_arches.machine.inputs.set(5, True)
    while not execution.done:
        cell_for_arches.now_ns = execution.next_change()
        execution.advance(cell_for_arches.now_ns)
    rest = cell_for_arches.tip()
    assert rest != left
    assert math.dist(rest[:2], (200, 420)) > 5
    assert cell_for_arches.run("Print TillOn") == "-1\r\n"


def test_two_arches_are_one_too_many(cell_for_arches):
    assert cell_for_arches.error("Jump XY(200, 420, -70, 50) C0 C1") == 2100


def test_an_arch_outlives_a_power_cycle(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.arches.set(2, Arch(1.5, 2.5))
    first.advance(1)
    first.restart()
    assert first.machine.kept.arches.get(2) == (1.5, 2.5)
    assert EpsonSimulator(state_path=kept).machine.kept.arches.get(2) == (1.5, 2.5)
