"""A tip touched onto a plane and onto a sphere, and one touch made again."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robolink.calibration import (
    TouchedPlane,
    rotation_of,
    rotations,
    solve_plane_touch,
    solve_sphere_touch,
    uvw_deg,
)
from robolink.errors import CalibrationError
from robolink.methods import (
    PlaneSurvey,
    PlaneTouchSource,
    SphereSurvey,
    SphereTouchSource,
    measure_plane_touch,
    measure_sphere_touch,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import SamplingPolicy, SurfaceTouches, touches_of
from robolink.runner import Ask, Confirm, TakenAgainError, TouchedAt
from tests.calibration._simulated import LEAST, MOST, refused
from tests.calibration._surface_person import PLAN, START, STORED, Ball, Plate, SurfacePerson
from tests.calibration._surface_person import TIP as TIP_AGAIN
from tests.calibration._tilting_person import turned_deg
from tests.calibration.test_surface_procedures import over_top

# A tip touched onto a plane and onto a sphere: against known truth.

TIP = np.array([12.0, -5.0, 120.0])
NORMALS = {
    "level": (0.0, 0.0, 1.0),
    "askew": (0.1, -0.2, 0.97),
    "wall": (0.95, 0.1, 0.2),
}


def unit(way):
    return np.array(way) / math.hypot(*way)


def oriented(rng, count, tilt_deg, down=True):
    """Return orientations turned at random and tilted by up to ``tilt_deg`` to all sides."""
    u = rng.uniform(-180, 180, count)
    lean, toward = tilt_deg * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(-180, 180, count)
    v, w = lean * np.cos(np.radians(toward)), lean * np.sin(np.radians(toward))
    return rotations(np.column_stack((u, v, w + (180.0 if down else 0.0))))


def pose_of(values, tool=0):
    x, y, z, u, v, w = values
    return Pose(x, y, z, u, v, w, tool=tool)


def poses_at(places, r, tip=TIP):
    return [
        pose_of((*(place - matrix @ tip).tolist(), *uvw_deg(matrix)))
        for place, matrix in zip(places, r, strict=True)
    ]


def on_plane(rng, count=12, tilt_deg=30.0, normal=(0.0, 0.0, 1.0), sigma_mm=0.0, spread_mm=60.0):
    n = unit(normal)
    a = unit(np.cross(n, (0.3, 1.0, 0.2)))
    across = rng.uniform(-spread_mm, spread_mm, (count, 2)) @ np.array([a, np.cross(n, a)])
    places = np.array([400.0, 50.0, -80.0]) + across
    places = places + rng.normal(0, sigma_mm, (count, 1)) * n if sigma_mm else places
    return poses_at(places, oriented(rng, count, tilt_deg))


def on_sphere(rng, count=14, tilt_deg=30.0, radius=12.7, sigma_mm=0.0):
    ways = rng.normal(0, 1, (count, 3))
    ways[:, 2] = np.abs(ways[:, 2])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    error = rng.normal(0, sigma_mm, (count, 1)) if sigma_mm else 0.0
    places = np.array([400.0, 50.0, -80.0]) + ways * (radius + error)
    return poses_at(places, oriented(rng, count, tilt_deg))


def xyz(result):
    return np.array(result.offset.components()[:3])


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS)
def test_a_tip_and_the_plane_it_touched_are_found_exactly(normal):
    result = solve_plane_touch(on_plane(np.random.default_rng(1), normal=normal))
    assert xyz(result) == pytest.approx(TIP, abs=1e-6)
    n = unit(normal)
    sign = math.copysign(1.0, n @ result.plane.normal)
    assert np.allclose(sign * np.array(result.plane.normal), n, atol=1e-7)
    assert sign * result.plane.distance_mm == pytest.approx(n @ (400, 50, -80), abs=1e-6)
    assert result.max_residual_mm == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("radius", [12.7, None])
def test_a_tip_and_the_sphere_it_touched_are_found_exactly(radius):
    result = solve_sphere_touch(on_sphere(np.random.default_rng(2)), radius_mm=radius)
    assert xyz(result) == pytest.approx(TIP, abs=1e-6)
    assert result.reference_point_mm == pytest.approx((400, 50, -80), abs=1e-6)
    assert result.radius_mm == pytest.approx(12.7, abs=1e-6)


def covered(solve, runs):
    """Return the share of runs in which the interval of each axis holds the truth."""
    rng, hits = np.random.default_rng(7), np.zeros(3)
    for _ in range(runs):
        result = solve(rng)
        hits += np.abs(xyz(result) - TIP) <= np.array(result.half_width95)
    return hits / runs


def plane_of_sixteen(rng, stated=None):
    poses = on_plane(rng, count=16, sigma_mm=0.02, normal=(0.1, 0.1, 1.0))
    return solve_plane_touch(poses, sigma_mm=stated)


def sphere_of_sixteen(rng, stated=None):
    return solve_sphere_touch(on_sphere(rng, count=16, sigma_mm=0.02), sigma_mm=stated)


@pytest.mark.parametrize(
    "solve", [pytest.param(plane_of_sixteen, marks=pytest.mark.soak), sphere_of_sixteen]
)
def test_the_interval_holds_the_truth_in_a_sample(solve):
    # Of 60, 57 are expected; 51 and fewer in 4 of 1,000.
    assert all(share > 0.86 for share in covered(solve, 60))


@pytest.mark.soak
@pytest.mark.parametrize("stated", [None, 0.02])
@pytest.mark.parametrize("solve", [plane_of_sixteen, sphere_of_sixteen])
def test_the_interval_holds_the_truth(solve, stated):
    shares = covered(lambda rng: solve(rng, stated), 2000)
    # Residuals that are large by chance widen the result of a stated sigma, and never narrow it.
    most = MOST if stated is None else 0.99
    assert all(LEAST <= share <= most for share in shares), shares


def test_a_plane_that_is_known_tells_z_far_better():
    poses = on_plane(np.random.default_rng(3), count=12)
    unknown = solve_plane_touch(poses, sigma_mm=0.02)
    known = solve_plane_touch(poses, plane=TouchedPlane((0.0, 0.0, 2.0), -160.0), sigma_mm=0.02)
    assert xyz(known) == pytest.approx(TIP, abs=1e-6)
    assert unknown.half_width95[2] > 5 * known.half_width95[2]


def test_orientations_that_cannot_tell_are_refused():
    rng = np.random.default_rng(4)
    for code, poses in (
        ("rank_deficient", on_plane(rng, tilt_deg=0.0)),
        ("insufficient_rotation", on_plane(rng, tilt_deg=4.0)),
        ("too_few_poses", on_plane(rng)[:1] * 8),
    ):
        with refused(code):
            solve_plane_touch(poses)
    one_way = [
        Pose(p.x_mm, p.y_mm, p.z_mm, 30.0, 0.0, 180.0, tool=0) for p in on_sphere(rng, tilt_deg=0.0)
    ]
    with refused("rank_deficient"):
        solve_sphere_touch(one_way)


def test_too_few_touches_and_foreign_poses_are_refused():
    rng = np.random.default_rng(5)
    with refused("too_few_poses"):
        solve_plane_touch(on_plane(rng, count=6))
    with refused("too_few_poses"):
        solve_sphere_touch(on_sphere(rng, count=7))
    with refused("tool_pose"):
        poses = [pose_of(pose.coordinates(), tool=2) for pose in on_plane(rng)]
        solve_plane_touch(poses)


def test_a_diameter_for_a_radius_and_a_bump_on_the_plane_are_told():
    rng = np.random.default_rng(6)
    with refused("radius_contradicted"):
        solve_sphere_touch(on_sphere(rng), radius_mm=25.4)
    poses = on_plane(rng, count=16)
    bumped = [*poses[:-1], pose_of(np.add(poses[-1].coordinates(), (0, 0, 4, 0, 0, 0)))]
    assert "large_residual" in solve_plane_touch(bumped).warnings


def test_a_copy_counts_once():
    poses = on_plane(np.random.default_rng(9), count=14, sigma_mm=0.02)
    once, twice = solve_plane_touch(poses), solve_plane_touch([*poses, *poses])
    assert twice.warnings == (*once.warnings, "duplicate_poses")
    assert (twice.dof, twice.half_width95) == (once.dof, once.half_width95)


def test_what_is_kept_is_kept():
    stored = ToolOffset(11.0, -4.0, 118.0, 7.0, 1.0, -2.0)
    result = solve_plane_touch(on_plane(np.random.default_rng(8)), stored=stored)
    assert result.offset.components()[3:] == (7.0, 1.0, -2.0)
    assert result.measured == ("x_mm", "y_mm", "z_mm")


# One touch of a surface made again: while others follow, at the fit, and from the new values.

KINDS = ("plane", "sphere")
LONG = pytest.mark.soak
UPRIGHTS = {"plane": 3, "sphere": 4}
COUNT = 12
MADE_AGAIN = {(0, "sphere"), (7, "plane")}
"""Tried each time: the touch that is made again, and the surface."""
_BALL = Ball(10.0)
_MEASURED: dict[str, tuple[Any, Any, Any]] = {
    "plane": (measure_plane_touch, PlaneTouchSource, PlaneSurvey(COUNT)),
    "sphere": (measure_sphere_touch, SphereTouchSource, SphereSurvey(9.0, COUNT)),
}


class Undecided(SurfacePerson):
    """Goes back at some of the touches, and accepts some of the offers.

    ``slips`` maps a touch, counted from 0 in order of the questions, to its distance from the
    surface; ``back`` maps one to the number of the touch to repeat in its place.
    """

    def __init__(self, kind, *, slips=(), back=(), accepts=0):
        self.slips, self.back = dict(slips), dict(back)
        start = {"start": over_top(_BALL)} if kind == "sphere" else {}
        surface = _BALL if kind == "sphere" else Plate(12.0, 50.0)
        super().__init__(surface, sigma_mm=0.0, hover=self._ends, **start)
        self.asks, self.offers, self._accepts = [], [], accepts
        self.left = 0

    def _ends(self, number, _height):
        return self.slips.get(number, 0.0)

    def run(self, procedure):
        answer = None
        try:
            while True:
                step = procedure.send(answer)
                while isinstance(step, Ask) and len(self.asks) + 1 in self.back:
                    self.asks.append(step.subject)
                    self.left = len(self.moves)
                    step = procedure.throw(TakenAgainError(self.back.pop(len(self.asks))))
                answer = self._answer(step)
        except StopIteration as finished:
            return finished.value

    def _answer(self, step):
        if isinstance(step, Confirm):
            self.offers.append(step)
            return len(self.offers) <= self._accepts
        if isinstance(step, Ask):
            self.asks.append(step.subject)
        return super()._answer(step)


def measured(kind, person, **more):
    measure, _, survey = _MEASURED[kind]
    return person.run(measure(PLAN, survey, stored=STORED, axes=6, **more))


def gone_on(kind, person, before, again):
    _, source, survey = _MEASURED[kind]
    here, taken = person.moves[-1].target, touches_of(before)
    return person.run(source(PLAN, survey, axes=6).further_steps(here, taken, again, STORED))


def miss_mm(result):
    return math.dist(result.offset.components()[:3], TIP_AGAIN.components()[:3])


def ends_well(person):
    """Return whether the tip kept clear, turned only when lifted, and ends upright and lifted."""
    assert person.lowest > PLAN.clearance_mm - 1.0
    assert person.flown > PLAN.lift_mm - 4.0
    assert person.swung < 2.0, "it tilts about the tip, over where that is"
    assert person.surface.height(person.tip_at(person.moves[-1].target)) > PLAN.lift_mm - 4.0
    return turned_deg(person.moves[-1].target, person.touches[0]) < 1e-6


@pytest.mark.parametrize(
    ("again", "kind"),
    [
        pytest.param(again, kind, marks=() if (again, kind) in MADE_AGAIN else LONG)
        for again in (0, 2, 7)
        for kind in KINDS
    ],
)
def test_from_the_values_one_touch_is_made_again_in_its_place_and_tilt(kind, again):
    person = Undecided(kind, slips={again: 0.1})
    before = measured(kind, person)
    assert miss_mm(before) > 0.01
    result = gone_on(kind, person, before, again)
    assert miss_mm(result) < 1e-6
    assert len(person.touches) == COUNT + 1
    assert turned_deg(person.touches[-1], person.touches[again]) < 1e-6
    assert math.dist(person.touches[-1].coordinates(), person.touches[again].coordinates()) < 2.0
    kept = [touch for number, touch in enumerate(before.inputs) if number != again]
    assert [touch for number, touch in enumerate(result.inputs) if number != again] == kept
    assert all(subject.retakes for subject in person.asks), "and any of them once more"
    assert result.inputs[again].arrival is not None, "made from a standoff, the first one too"
    if again < UPRIGHTS[kind]:
        # It may be the one that the others contradict, so the surface counts as unknown.
        survey = _MEASURED[kind][2]
        unknown_mm = survey.rise_mm if kind == "plane" else survey.aside_mm
        assert math.hypot(*result.inputs[again].standoff_mm) > PLAN.clearance_mm + unknown_mm
    assert ends_well(person)


@pytest.mark.parametrize("kind", KINDS)
def test_one_that_is_made_again_at_its_standoff_is_refused_as_any_other(kind):
    person = Undecided(kind, slips={5: 0.05, COUNT: 0.4})
    before = measured(kind, person)
    with pytest.raises(CalibrationError) as refused:
        gone_on(kind, person, before, 5)
    assert refused.value.code == "large_residual"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("at", "number"), [(3, 1), pytest.param(6, 5, marks=LONG), (9, 2)])
def test_at_a_touch_an_earlier_one_is_made_again_and_the_others_stay(kind, at, number):
    person = Undecided(kind, slips={number - 1: 0.1}, back={at: number})
    result = measured(kind, person)
    assert miss_mm(result) < 1e-6
    asked = [subject.number for subject in person.asks]
    assert asked == [*range(1, at + 1), number, *range(at, COUNT + 1)]
    assert all(subject.retakes and subject.total == COUNT for subject in person.asks)
    assert len(result.inputs) == COUNT
    assert ends_well(person)


@pytest.mark.parametrize("kind", KINDS)
def test_the_tool_tilts_back_over_the_place_at_which_it_was_gone_back_from(kind):
    person = Undecided(kind, back={9: 2})
    measured(kind, person)
    lifted, tilted = person.moves[person.left], person.moves[person.left + 1]
    assert "Lifting" in lifted.purpose
    assert "Tilting" in tilted.purpose
    at, then = person.tip_at(lifted.target), person.tip_at(tilted.target)
    assert math.dist(at[:2], then[:2]) < 2.0


def test_an_upright_touch_that_was_far_off_moves_the_places_that_are_left():
    person = Undecided("plane", slips={1: 2.0}, back={8: 2})
    result = measured("plane", person)
    assert miss_mm(result) < 1e-6
    plate = person.surface
    left = [touch for number, touch in enumerate(result.inputs) if number >= 7]
    for touch in left:
        planned_mm = math.hypot(*touch.standoff_mm)
        stopped_mm = plate.height(person.tip_at(touch.arrival))
        assert abs(stopped_mm - planned_mm) < 1.0
        across = np.array(touch.standoff_mm) / planned_mm
        assert across @ plate.normal > 0.999, "it comes down along the plane's own normal"


def test_beside_a_touch_that_is_made_again_all_others_count():
    touches = SurfaceTouches(PLAN)
    places = [TouchedAt.of(replace(START, x_mm=x)) for x in (0.0, 1.0, 2.0, 3.0)]
    touches.adopt(dict(enumerate(places)))
    assert touches.taken == tuple(places)
    assert touches.others(1) == (places[0], *places[2:])
    assert touches.others(7) == tuple(places)


def test_an_upright_touch_of_a_ball_that_was_off_moves_the_places_that_are_left():
    def expected(person):
        return [
            np.subtract(touch.arrival.coordinates()[:3], touch.standoff_mm)
            for touch in measured("sphere", person).inputs[-4:]
        ]

    right = expected(Undecided("sphere", back={9: 2}))
    mended = expected(Undecided("sphere", slips={1: 0.3}, back={9: 2}))
    assert np.abs(np.subtract(right, mended)).max() < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_at_the_fit_the_worst_is_offered_and_made_again(kind):
    person = Undecided(kind, slips={6: 0.12}, accepts=1)
    result = measured(kind, person, sampling=SamplingPolicy(retake=True))
    assert miss_mm(result) < 1e-6
    assert person.offers[0].fit.worst == 6
    assert len(person.offers[0].fit.rows) == COUNT
    assert len(person.touches) == COUNT + 1
    assert rotation_of(person.moves[-1].target) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )
