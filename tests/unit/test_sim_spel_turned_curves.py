"""Curve on six axes and past an external control point (docs/reference/spel.md 7.1)."""

import json
import math
import random
from itertools import pairwise

import pytest
from robolink_simulators.cell.frames import axis_and_angle, product, subtract, transposed
from robolink_simulators.epson import EpsonOptions
from robolink_simulators.epson.arm.coordinate_systems import frame_at
from robolink_simulators.epson.arm.curves import (
    CurveFiles,
    CurveSwitch,
    FreeCurve,
    smooth_course_through,
)
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.interpreter import Interpreter

from robolink.model import Pose
from tests.unit.test_sim_spel_motion import Cell

MS = 1_000_000


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
    # Each angle runs by itself: what no point changes stays.
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
    # The tip itself goes otherwise, and is at the taught places all the same.
    own = [math.dist(a.shift_mm, b.shift_mm) for a, b in pairwise(frames)]
    assert max(abs(a - b) for a, b in zip(own[80:-80], steps[80:-80], strict=True)) > 0.05
    assert min(off(frame, point(cell, 2)) for frame in frames) < 0.5
    assert off(frames[lit[0]], point(cell, 2)) < 1
    assert off(frames[-1], point(cell, 3)) < 1e-3


def test_a_turn_about_the_control_point_alone_is_no_way_past_it():
    cell = four_axes()
    cell.run("ECPSet 1, XY(200, 400, -40, 0)")
    assert cell.start('Curve "c", O, 16, 4, P1, P1 +U(9), P2').error.number == 4002


@pytest.mark.parametrize(
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
