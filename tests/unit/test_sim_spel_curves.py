"""Curve stores a free curve, CVMove travels it (docs/reference/spel.md 7.1)."""

import math
from itertools import pairwise

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.curves import CurveSwitch, FreeCurve, through

from tests.unit.test_sim_spel_motion import Cell

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
    """Return the tips of a motion every 2 ms, bits switched on the way."""
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
    # In 2 ms it goes 0.4 mm.
    assert all(nearest(tips, point) < 0.5 for point in POINTS)
    steps = [math.dist(a[:3], b[:3]) for a, b in pairwise(tips)]
    assert max(steps) == pytest.approx(0.4, abs=0.02)
    # It does not stand at the points between, and does not turn there: no chord of 20 ms bends.
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
