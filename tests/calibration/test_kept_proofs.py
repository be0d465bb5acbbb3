"""A turn test where another offset was written, and a new offset that is not trusted."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.calibration import (
    Beam,
    BoardDrawing,
    Pin,
    Sighting,
    flange_of,
    impact_on,
    rotation_of,
    solve_camera_round,
    tip_pose,
    update_guard,
    uvw_deg,
)
from robolink.calibration_run import Limits
from robolink.controllers import SimpleController
from robolink.methods import (
    Absolute,
    AllRoundPlan,
    AxisTeachPlan,
    BeamsSource,
    BoardSource,
    CameraSource,
    NAngleSource,
    OneTouchSource,
    PivotSource,
    PlaneSurvey,
    PlaneTouchSource,
    RunoutTableSource,
    SixPointSource,
    SphereSurvey,
    SphereTouchSource,
    TwoPoseSource,
    ZTouchParameters,
    ZTouchSource,
    informative_tilts,
)
from robolink.methods.surface_touch.plane_procedure import PlaneTest
from robolink.methods.surface_touch.sphere_procedure import SphereTest
from robolink.model import Path, Pose, SpotUnit, ToolOffset, rotate_xy
from robolink.procedures import LookPlan, MeasurementContext, TouchPlan
from robolink.procedures.tilt_proof import TiltingProof
from robolink.runner import Ask, Move, TouchedAt
from robolink.stations import BeamStation, CameraStation, TouchStation
from robolink.testing import PaperCell
from tests.calibration._simulated import refused
from tests.calibration._surface_person import Ball, Plate

# A proof as a source makes it, where another offset was written than the tip that was found.
#
# So it is with a difference to a reference (docs/recipes.md): the frame in force is beside the tip,
# and turning about it moves the tip. Each proof passes for the tip that was found, and for no
# other.

HERE = Pose(300.0, 100.0, 20.0, 0.0, tool=0)
STORED = ToolOffset(12.0, -4.0, -20.0, 35.0)
TRUE = ToolOffset(12.3, -3.9, -20.4, 35.0)
"""The real tip. The tool is turned against the flange, so that mixed-up axes show."""

ASIDE = {"x_mm": 1.7, "y_mm": -1.1, "z_mm": 1.8}
"""The difference between the written and the measured value: that of a reference."""

SURFACES = PlaneTest, SphereTest
PIN = (310.0, 95.0, -40.0)
BOARD = BoardDrawing.of_two(40)
BEAMS = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4), off_when_broken=True)
WITH_BEAMS = {3: lambda at: abs(at[1] - 80) >= 0.4, 4: lambda at: abs(at[0] - 300) >= 0.4}
ON_PLATE = {5: lambda at: at[2] < -50}
STATION = CameraStation(300, 80, -30)
OFF_MM = 0.3, -0.5
"""The error of the camera, which a measurement at several angles finds."""


ALL_ROUND = AllRoundPlan(turns_deg=tuple(30.0 * step for step in range(12)))


class Eye:
    """A camera that answers in millimetres with the sightings of the paper cell."""

    identity, unit, resolution_px, settle_s = "eye", SpotUnit.BASE_MM, None, 0.0

    def see(self, mark=0):
        pytest.fail(f"what is seen of mark {mark} the paper cell says, and no camera is asked")

    def close(self):
        pass


class Cell(PaperCell):
    """A paper cell whose camera is off, with turn tests as in a change."""

    written: ToolOffset | None = None
    wobble_mm = 0.0

    def run(self, procedure, *, tip=None, camera=None):
        assert tip == self.written, "limits lie about the new tip, and nothing is repeated"
        return super().run(procedure)

    def pose(self):
        return self.here

    @property
    def controller(self):
        return SimpleNamespace(groups=[self])

    def _shown(self, step):
        found = super()._shown(step)
        made = replace(TouchedAt.of(found, seconds=4.0), arrival=self.here)
        assert step.judge is None or step.judge(made) is None, "nothing speaks against it"
        return found

    def _seen(self, step):
        seen = super()._seen(step)
        # A tip with runout is off its place when the flange turns, twice a turn.
        own_deg = self.written.u_deg if self.written else 0.0
        twice = 2 * math.radians(self.here.u_deg - own_deg)
        x_mm = seen.spot.x + OFF_MM[0] + self.wobble_mm * math.cos(twice)
        y_mm = seen.spot.y + OFF_MM[1] + self.wobble_mm * math.sin(twice)
        return replace(seen, spot=replace(seen.spot, x=x_mm, y=y_mm))


def onto(surface):
    return lambda at: tuple((at + surface.way(at)).tolist())


@dataclass(frozen=True)
class Case:
    """A source and its paper cell; ``slip`` is the shift that its turn test must detect."""

    source: Any
    cell: dict[str, Any]
    slip: str = "x_mm"
    wobble_mm: float = 0.0


CASES = {
    "two-pose": Case(TwoPoseSource(), {"touched": PIN}),
    "n-angle": Case(NAngleSource((120.0, 240.0)), {"touched": PIN}),
    "one-touch": Case(OneTouchSource(Absolute(Pin(*PIN), 0.02)), {"touched": PIN}),
    "pivot": Case(PivotSource(informative_tilts(4, 20.0)), {"touched": PIN}),
    "six-point": Case(
        SixPointSource(informative_tilts(4, 20.0), ways=AxisTeachPlan(10.0)), {"touched": PIN}
    ),
    "plane-touch": Case(
        PlaneTouchSource(TouchPlan(), PlaneSurvey(9), axes=6),
        {"touched": onto(Plate(15.0, 50.0, point=PIN))},
        "z_mm",
    ),
    "sphere-touch": Case(
        SphereTouchSource(TouchPlan(), SphereSurvey(10.0, 11), axes=6),
        {"touched": onto(Ball(10.0, centre=(310.0, 95.0, -50.0)))},
        "z_mm",
    ),
    "camera": Case(CameraSource(Eye(), STATION), {}),
    "board": Case(BoardSource(Eye(), STATION, BOARD), {}),
    "runout-table": Case(RunoutTableSource(Eye(), STATION, ALL_ROUND), {}, wobble_mm=0.25),
    "beams": Case(BeamsSource(BEAMS), {"switches": WITH_BEAMS}),
    "z-touch": Case(ZTouchSource(TouchStation(320, 60, -50, 5)), {"switches": ON_PLATE}, "z_mm"),
}


def paper(case, here, tip):
    """Return a cell whose frame holds a tip, and a board if that is measured."""
    of_board = isinstance(case.source, BoardSource)
    marks = dict(enumerate(BOARD.seen_from(tip), start=1)) if of_board else None
    cell = Cell(here, tip, marks=marks, **case.cell)
    cell.wobble_mm = case.wobble_mm
    return cell


def seen_from(frame, flange, tip):
    """Return the tip of a flange, seen from a frame, by plain matrices."""
    place = rotation_of(flange) @ tip.components()[:3] + flange.coordinates()[:3]
    x_mm, y_mm, z_mm = (rotation_of(frame).T @ (place - frame.coordinates()[:3])).tolist()
    return ToolOffset(x_mm, y_mm, z_mm)


@pytest.fixture(scope="module")
def measured():
    """Return each measurement, made once, and the final flange pose."""
    made: dict[str, Any] = {}

    def measure(method):
        if method not in made:
            case = CASES[method]
            cell = paper(case, HERE, TRUE)
            result = cell.run(case.source.procedure(STORED, HERE))
            made[method] = result, cell.here
        return made[method]

    return measure


def kept(case, result, flange):
    """Return the turn test of a written difference, and the written offset."""
    found = result.offset
    aside = ASIDE | ({"u_deg": 4.0} if "u_deg" in result.measured else {})
    written = replace(found, **{name: getattr(found, name) + by for name, by in aside.items()})
    nobody: Any = None
    with SimpleController() as controller:
        context = MeasurementContext(controller, nobody, start=flange, settings=Limits().settings)
        context.stands = flange
        proof = case.source.proof(
            context, 1, replace(result, offset=written), tip=found, tolerance_mm=0.1
        )
    return proof, written


def moved_away(flange):
    """Return the place to which somebody moved it meanwhile: over the pin again, and turned."""
    turned = replace(flange, u_deg=flange.u_deg - 110.0)
    x_mm, y_mm, z_mm = (PIN - rotation_of(turned) @ TRUE.components()[:3]).tolist()
    return replace(turned, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm + 15.0)


def apart_deg(one, other):
    cosine = (np.trace(rotation_of(one).T @ rotation_of(other)) - 1) / 2
    return math.degrees(math.acos(min(1.0, max(-1.0, float(cosine)))))


def test_the_proof_of_a_length_turns_on_from_u_of_the_tool(measured):
    result, flange = measured("z-touch")
    proof, written = kept(CASES["z-touch"], result, flange)
    turn_deg = ZTouchParameters().proof_turn_deg
    assert proof.angles_deg == pytest.approx((flange.u_deg + written.u_deg - turn_deg,))


@pytest.mark.parametrize(
    ("measured_at", "planned", "tested_at"),
    [
        ((0.0, 32.0, 64.0, 96.0), (0.0, 32.0, 64.0, 96.0), (90.0, 5.0)),
        ((40.0, 8.0, -24.0, -56.0), (0.0, 32.0, 64.0, 96.0), (-50.0, 35.0)),
        ((0.0, 16.0, 32.0, 48.0), (0.0, 32.0, 64.0, 96.0), (45.0, 2.5)),
        ((10.0, -80.0, -20.0), (0.0, 90.0, 30.0), (-80.0, 5.0)),
        ((-20.0,), (0.0,), (70.0, -15.0)),
        ((30.0,), (0.0,), (-60.0, 25.0)),
    ],
    ids=["as planned", "to the other side", "half as far", "not in order", "one look", "toward 0"],
)
def test_a_camera_tests_at_the_planned_angles_as_it_measured(measured_at, planned, tested_at):
    """What the arm could only do to the other side, or half as far, is tested there as well."""
    written = ToolOffset(12, -4, -20, 8)
    plan = LookPlan(turns_deg=planned)
    source = CameraSource("eye", STATION, plan, test_turns_deg=(90.0, 5.0))
    looks = []
    for u_deg in measured_at:
        dx, dy = rotate_xy(12, -4, u_deg)
        looks.append(Sighting(Pose(300 - dx, 80 - dy, -10, u_deg, tool=0), 300.0, 80.0))
    result = replace(solve_camera_round(looks), offset=written)
    nobody: Any = None
    proof: Any = source.proof(nobody, 1, result, tip=written, tolerance_mm=0.1)
    assert proof.angles_deg == pytest.approx([angle + written.u_deg for angle in tested_at])


@pytest.mark.parametrize(
    ("sensor", "why"),
    [
        (Eye(), "camera_open"),
        ("opcua+tcp://someone:secret@192.168.0.9/tip", "camera_token"),
        ("opcua+tcp://192.168.0.9/tip", ""),
    ],
)
def test_a_camera_is_kept_by_its_address_where_that_holds_no_secret(sensor, why, measured):
    result, flange = measured("camera")
    case = replace(CASES["camera"], source=CameraSource(sensor, STATION))
    proof, _ = kept(case, result, flange)
    assert proof.obstacle == why


@pytest.mark.parametrize("after_a_break", [False, True], ids=["at once", "after a break"])
@pytest.mark.parametrize("method", CASES)
def test_a_difference_that_was_written_is_proved_by_the_tip_that_was_found(
    method, after_a_break, measured
):
    case = CASES[method]
    result, flange = measured(method)
    proof, written = kept(case, result, flange)
    flange = moved_away(flange) if after_a_break else flange
    frame = tip_pose(flange, written, tool=1)
    tip = replace(seen_from(frame, flange, TRUE), u_deg=TRUE.u_deg - written.u_deg)
    slipped = replace(tip, **{case.slip: getattr(tip, case.slip) + 0.4})
    found = []
    for one in (tip, slipped):
        cell = paper(case, frame, one)
        cell.written = written
        found.append(proof.prove_after_a_break(cell) if after_a_break else proof.prove(cell))
        asked = [step.foreseen for step in cell.steps if isinstance(step, Ask) and step.foreseen]
        before = [tip_pose(pose, written, tool=1) for pose in result.inputs]
        fresh = [min(apart_deg(at, pose) for pose in before) > 10.0 for at in asked]
        # A pin is touched again where it was touched; a surface only at new places.
        assert all(fresh) if isinstance(proof, SURFACES) else any(fresh) or not proof.by_touch
        if proof.method == "pivot":
            own = rotation_of(Pose(0.0, 0.0, 0.0, *written.components()[3:]))
            for move in (step.target for step in cell.steps if isinstance(step, Move)):
                # A five-axis robot tilts its tool about the flange's own Y only.
                assert uvw_deg(rotation_of(move) @ own.T)[2] == pytest.approx(0.0, abs=1e-6)
    right, wrong = found
    assert right.passed
    # Between two looks of its table the runout is interpolated.
    assert right.max_drift_mm < (0.03 if case.wobble_mm else 1e-3)
    assert not wrong.passed
    assert wrong.max_drift_mm > 0.3
    if after_a_break and isinstance(proof, TiltingProof):
        assert [type(step) for step in cell.steps[:2]] == [Ask, Move], "a person shows it first"
        assert cell.steps[1].path is Path.STRAIGHT


# A new offset that is not believed is not let through.
#
# What a change of an offset does at taught points, against two simulated arms.

STORED_BEFORE = ToolOffset(12.0, -3.0, -20.0)


def test_an_ordinary_change_passes_and_is_told():
    correction = update_guard(ToolOffset(12.3, -3.4, -20.0), stored=STORED_BEFORE)
    assert correction.distance_mm == pytest.approx(0.5)
    assert (correction.dx_mm, correction.dy_mm) == pytest.approx((0.3, -0.4))
    assert correction.ratio is None


def test_a_jump_is_refused_and_the_limit_can_be_set():
    far = ToolOffset(15.0, -3.0, -20.0)
    with refused("implausible_change"):
        update_guard(far, stored=STORED_BEFORE)
    assert update_guard(far, stored=STORED_BEFORE, max_change_mm=5.0).distance_mm == pytest.approx(
        3
    )


@pytest.mark.parametrize("gain", [-1.0, -0.6, 2.05, 2.2])
def test_a_loop_with_a_wrong_sign_or_gain_is_stopped_at_its_second_turn(gain):
    # Each turn measures the remaining error and applies gain times too much of it.
    error, stored = 0.4, STORED_BEFORE
    history: list[float] = []
    with refused("diverging"):
        for _ in range(4):
            step = gain * error
            new = ToolOffset(stored.x_mm + step, stored.y_mm, stored.z_mm)
            correction = update_guard(new, stored=stored, earlier_mm=history, max_change_mm=9)
            history.append(correction.distance_mm)
            stored, error = new, error - step
    assert len(history) == 1


def test_a_loop_that_converges_goes_on():
    correction = update_guard(
        ToolOffset(12.1, -3, -20), stored=STORED_BEFORE, earlier_mm=[0.9, 0.3]
    )
    assert correction.ratio == pytest.approx(1 / 3)


def test_a_correction_is_the_new_offset_less_the_stored_one():
    found = update_guard(ToolOffset(12.1, -3.2, -20.3), stored=STORED_BEFORE)
    assert (found.dx_mm, found.dy_mm, found.dz_mm) == pytest.approx((0.1, -0.2, -0.3))


def test_growth_within_the_noise_is_no_divergence():
    update_guard(ToolOffset(12.03, -3, -20), stored=STORED_BEFORE, earlier_mm=[0.01])
    with refused("diverging"):
        update_guard(
            ToolOffset(12.03, -3, -20), stored=STORED_BEFORE, earlier_mm=[0.01], noise_mm=0.02
        )


LENGTH = st.floats(-300, 300)
ANGLE = st.floats(-360, 360)
OFFSETS = st.builds(ToolOffset, LENGTH, LENGTH, LENGTH, ANGLE)
POINTS = st.builds(Pose, LENGTH, LENGTH, LENGTH, ANGLE)


def driven(point, believed, real):
    """Return the ``real`` tip's place when a controller moves the ``believed`` one to a point."""
    flange_u = point.u_deg - believed.u_deg
    tip_x, tip_y = rotate_xy(real.x_mm - believed.x_mm, real.y_mm - believed.y_mm, flange_u)
    return (
        point.x_mm + tip_x,
        point.y_mm + tip_y,
        point.z_mm + real.z_mm - believed.z_mm,
    )


def at(point, old, new):
    (entry,) = impact_on({1: point}, old=old, new=new).entries
    return entry


@given(POINTS, OFFSETS, OFFSETS)
@settings(max_examples=60, deadline=None)
def test_it_is_where_the_new_tip_goes_with_the_new_value_against_with_the_old(point, old, new):
    entry = at(point, old, new)
    before, after = driven(point, old, new), driven(point, new, new)
    expected = [a - b for a, b in zip(after, before, strict=True)]
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx(expected, abs=1e-9)


@given(POINTS, OFFSETS, st.floats(-5, 5), st.floats(-5, 5))
@settings(max_examples=60, deadline=None)
def test_an_unchanged_nozzle_leaves_the_taught_place_by_as_much(point, old, dx, dy):
    new = ToolOffset(old.x_mm + dx, old.y_mm + dy, old.z_mm, old.u_deg)
    entry = at(point, old, new)
    before, after = driven(point, old, old), driven(point, new, old)
    assert before[:2] == pytest.approx((point.x_mm, point.y_mm))
    assert (entry.dx_mm, entry.dy_mm) == pytest.approx(
        (after[0] - before[0], after[1] - before[1]), abs=1e-9
    )


@given(st.lists(POINTS, min_size=1, max_size=6), OFFSETS, OFFSETS)
@settings(max_examples=40, deadline=None)
def test_on_four_axes_the_distance_is_the_same_at_every_point(points, old, new):
    impact = impact_on(dict(enumerate(points)), old=old, new=new)
    length = math.dist(old.components()[:3], new.components()[:3])
    assert [entry.distance_mm for entry in impact.entries] == pytest.approx(
        [length] * len(points), abs=1e-9
    )
    assert impact.largest is impact.entries[0]


def test_a_hand_calculated_case():
    entry = at(Pose(250, 200, -30, 90), ToolOffset(12, 0, -20), ToolOffset(12.5, 0, -21))
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx((0, -0.5, 1))


def test_a_new_tool_angle_turns_the_nozzle_the_other_way():
    entry = at(Pose(250, 200, -30, 90), ToolOffset(u_deg=350), ToolOffset(u_deg=10))
    assert entry.turn_deg == pytest.approx(-20)
    assert entry.distance_mm == 0


def test_points_that_cannot_be_judged_are_named_and_left_out():
    points = {
        1: Pose(250, 200, 0, 0),
        2: None,
        3: Pose(10, 20, 0, 0, local=2),
    }
    impact = impact_on(points, old=ToolOffset(1), new=ToolOffset(2))
    assert [entry.number for entry in impact.entries] == [1]
    assert impact.undefined == (2,)
    assert impact.other_local == {3: 2}


@pytest.mark.parametrize("pose", [Pose(250, 200, 0, 40, 0, 180), Pose(250, 200, 0, 40, 20, -150)])
def test_a_leaning_tool_is_judged_in_space(pose):
    """The flange with the old offset, and the shift that it causes, written out in full."""
    old, new = ToolOffset(12, -3, 120, 10, 5, -4), ToolOffset(12.4, -3.3, 119.5, 12, 6, -4)
    flange = flange_of(pose, old)
    entry = at(pose, old, new)
    # The tip on the arm is at the new offset: there it moves with the old one.
    there = tip_pose(flange, new, tool=1)
    moved = [a - b for a, b in zip(pose.coordinates(), there.coordinates(), strict=True)][:3]
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx(moved)
    assert entry.distance_mm == pytest.approx(math.dist((12, -3, 120), (12.4, -3.3, 119.5)))
    assert 1.0 < entry.turn_deg < 3.0


def test_upside_down_a_longer_tip_moves_up():
    entry = at(Pose(250, 200, 0, 90, 0, 180), ToolOffset(0, 1, 100, 10), ToolOffset(0, 1, 101, 30))
    assert (entry.dx_mm, entry.dy_mm, entry.dz_mm) == pytest.approx((0, 0, 1))
    assert entry.turn_deg == pytest.approx(-20)
