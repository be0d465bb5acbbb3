"""Cells that obey every page and still have a wrong tip, with the required end of each.

Before there were two statements, all of them wrote, tested and accepted a value more than three
times its interval off (docs/reference/evidence.md 21).
"""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import pytest

from robolink.calibration import Pin, turn_test_sentences
from robolink.methods import (
    Absolute,
    NAngleSource,
    OneTouchSource,
    PlaneSurvey,
    PlaneTouchSource,
    TwoPoseSource,
)
from robolink.model import InputEdge
from robolink.procedures import TouchPlan
from tests.certificate.live import (
    BY_NAME,
    Course,
    Person,
    change,
    person_at,
    slips,
    wrong_by,
)
from tests.contract._camera_cell import furnish
from tests.contract._sensor_cell import TOOL

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

REFUSED, TAKEN_BACK, WITHIN, DOUBTED = "refused", "taken back", "within U", "doubted"
CONTRADICTED = ("proof_contradicts_accuracy", "proof_contradicts_repeatability")

Toward = float
Wrong = Callable[[Toward], Callable[[Any], None]]


def nothing(_toward: Toward) -> Callable[[Any], None]:
    return lambda _cell: None


def moved(mm: float) -> Wrong:
    """Move the station after it was learnt."""
    return lambda toward: wrong_by({"place_mm": (mm * math.cos(toward), mm * math.sin(toward))})


def slipped(mm: float) -> Wrong:
    """Let the nozzle slip in its mount."""
    return lambda toward: slips(mm * math.cos(toward), mm * math.sin(toward))


def slipped_up(mm: float) -> Wrong:
    return lambda _toward: slips(0.0, 0.0, mm)


def beside(mm: float) -> Wrong:
    """Let the person always stop on the same side of the tool."""
    return lambda toward: wrong_by({"touch_mm": (mm * math.cos(toward), mm * math.sin(toward))})


def bent(lean_deg: float) -> Wrong:
    return lambda toward: wrong_by({"bend_deg": (lean_deg, math.degrees(toward))})


def with_tip_off(mm: float, wrong: Callable[[Any], None]) -> Wrong:
    """Put the new tip far from the old one, with another error besides."""

    def put_in(toward: Toward, cell: Any) -> None:
        world, stored = cell.simulator.world, held(cell)
        by = mm * math.cos(toward), mm * math.sin(toward)
        tip = replace(stored, x_mm=stored.x_mm + by[0], y_mm=stored.y_mm + by[1])
        world.tips[TOOL] = tip
        wrong(cell)

    return lambda toward: partial(put_in, toward)


def held(cell: Any) -> Any:
    stored = cell.stored if hasattr(cell.simulator, "machine") else None
    return stored or cell.simulator.world.tips[TOOL]


def faults(**parameters: Any) -> Wrong:
    return lambda _toward: lambda cell: furnish(cell, **parameters)


def bumped(mm: float) -> Wrong:
    """Bump the pin between the two touches."""
    return lambda toward: partial(
        furnish,
        pin_bumped_after_touch=1,
        pin_bump_mm=mm,
        pin_bump_toward_deg=math.degrees(toward) % 360.0,
    )


def by_sensors(name: str, **more: Any) -> Course:
    return replace(BY_NAME[name], **more)


def without_noise(cell: Any, rng: random.Random) -> Any:
    """Beams whose edges do not scatter, except by the cycle of the PLC."""
    source = BY_NAME["beams on PLC"].source(cell, rng)
    cell.mount_beams(cell.beams(radius_mm=0.1))
    return source


def with_contact_input(cell: Any, _rng: random.Random) -> Any:
    """An input that shows the tip on the pin, at any place on it."""
    furnish(cell, contact_input=9)
    return NAngleSource((90.0, 180.0, 270.0), TouchPlan(contact=InputEdge(9)))


def one_touch_by_input(cell: Any, rng: random.Random) -> Any:
    """The same input, which shows the height of the tip as well."""
    furnish(cell, contact_input=9)
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    pin = Pin(x_mm, y_mm, z_mm, sigma_mm=0.005)
    touch = TouchPlan(contact=InputEdge(9), clearance_mm=5.0, seed=rng.getrandbits(32))
    return OneTouchSource(Absolute(pin, 0.01), touch)


ONE_BY_INPUT = by_sensors("one-touch on EPSON", source=one_touch_by_input)
BY_INPUT = by_sensors("n-angle on EPSON", source=with_contact_input)
SURE_PERSON = by_sensors(
    "two-pose on EPSON", source=lambda _cell, _rng: TwoPoseSource(sigma_mm=0.01)
)
NO_NOISE = by_sensors("beams on PLC", source=without_noise)


@dataclass(frozen=True)
class Cell:
    """A cell with a wrong tip.

    Attributes:
        what: The error.
        course: The method and its cell.
        must: The required end.
        codes: The permitted codes; for a value that must be within U, the codes with which it may
            be refused instead.
        wrong: Applies the error, in a direction.
        at_write: The same during the write.
        rows: The rows that the cell states.
        interval_mm: The tip error that its process allows.
        times: The largest error in multiples of U.
        each_time: Whether it is tried each time, not only in soak.
    """

    what: str
    course: str | Course
    must: str
    codes: tuple[str, ...] = ()
    wrong: Wrong = nothing
    at_write: Wrong = nothing
    rows: dict[str, float] = field(default_factory=dict)
    interval_mm: float | None = None
    times: float = 1.0
    each_time: bool = True

    @property
    def of(self) -> Course:
        """The method and its cell."""
        return BY_NAME[self.course] if isinstance(self.course, str) else self.course

    @property
    def name(self) -> str:
        """The name in pytest."""
        return f"{self.what}: {self.of.name}"


def soak(*cells: Cell) -> tuple[Cell, ...]:
    return tuple(replace(cell, each_time=False) for cell in cells)


CHANGED = ("camera_changed",)
STILL = ("tip_did_not_move",)
OVER = ("large_interval",)
BENT = {0.5: (), 1.0: (), 1.9: ("bent_needle",)}
"""The tilt in degrees, and its refusals: a PLC's latch may make more than 2 degrees of it."""

CELLS = (
    *soak(
        Cell("moved by 0.05", "beams on EPSON", TAKEN_BACK, CONTRADICTED, moved(0.05)),
        Cell("moved by 0.08", "beams on EPSON", TAKEN_BACK, CONTRADICTED[:1], moved(0.08)),
        Cell("moved by 0.05", "beams on PLC", TAKEN_BACK, CONTRADICTED, moved(0.05)),
        Cell("moved by 0.08", "beams on PLC", TAKEN_BACK, CONTRADICTED, moved(0.08)),
        # Turned by 90 degrees, moved beams show by 1.4 times what they were moved; by 180, twice.
        Cell("moved by 0.05", "beams once on EPSON", TAKEN_BACK, CONTRADICTED, moved(0.05)),
        Cell("moved by 0.08", "beams once on EPSON", TAKEN_BACK, CONTRADICTED[:1], moved(0.08)),
        Cell("moved by 0.08", "beams once on PLC", TAKEN_BACK, CONTRADICTED, moved(0.08)),
        Cell("moved by 0.08", "beams --turn on EPSON", WITHIN, (), moved(0.08), times=1.2),
    ),
    Cell(
        "turned by 10 degrees, tip 0.9 off",
        "camera on EPSON",
        REFUSED,
        CHANGED,
        with_tip_off(0.9, wrong_by({"camera_turn_deg": (10.0,)})),
    ),
    Cell(
        "scale x 1.25, tip 1.3 off",
        "camera on PLC",
        REFUSED,
        CHANGED,
        with_tip_off(1.3, wrong_by({"camera_scale_percent": (25.0,)})),
    ),
    *soak(
        *(
            Cell(what, course, REFUSED, CHANGED, with_tip_off(mm, wrong_by(by)))
            for course in (
                "camera on EPSON",
                "camera on PLC",
                "camera, quick on EPSON",
                "camera, quick on PLC",
                "camera, one look on EPSON",
            )
            for what, mm, by in (
                ("turned by 10 degrees, tip 0.9 off", 0.9, {"camera_turn_deg": (10.0,)}),
                ("turned by -4 degrees, tip 0.9 off", 0.9, {"camera_turn_deg": (-4.0,)}),
                ("scale x 1.25, tip 1.3 off", 1.3, {"camera_scale_percent": (25.0,)}),
                ("scale x 0.9, tip 1.3 off", 1.3, {"camera_scale_percent": (-10.0,)}),
            )
        ),
        Cell(
            "mirrored",
            "camera on EPSON",
            REFUSED,
            CHANGED,
            faults(camera_mirrored=False),
        ),
    ),
    Cell("moved by 0.05", "camera, one look on EPSON", TAKEN_BACK, CONTRADICTED, moved(0.05)),
    *soak(
        Cell("moved by 0.05", "camera, one look on PLC", TAKEN_BACK, CONTRADICTED, moved(0.05)),
        Cell("moved by 0.05", "camera on EPSON", WITHIN, (), moved(0.05)),
    ),
    Cell("bumped by 0.15 between", SURE_PERSON, TAKEN_BACK, CONTRADICTED[:1], bumped(0.15)),
    *(
        Cell(f"slips by {mm:g}", course, TAKEN_BACK, CONTRADICTED, at_write=slipped(mm))
        for course, mm in (
            ("camera on PLC", 0.08),
            ("camera on EPSON", 0.05),
            ("camera, quick on EPSON", 0.03),
        )
    ),
    Cell(
        "slips up by 0.075",
        ONE_BY_INPUT,
        TAKEN_BACK,
        CONTRADICTED,
        at_write=slipped_up(0.075),
    ),
    *soak(
        *(
            Cell(f"slips by {mm:g}", course, TAKEN_BACK, CONTRADICTED, at_write=slipped(mm))
            for course in (
                "beams on EPSON",
                "beams on PLC",
                "beams once on EPSON",
                "beams --turn on EPSON",
                "camera on EPSON",
                "camera, quick on EPSON",
                "camera, quick on PLC",
                "camera, one look on EPSON",
                "camera-affine on EPSON",
                "runout-table on PLC",
                "board on PLC",
            )
            for mm in (0.05, 0.08)
            if (course, mm) not in {("beams on PLC", 0.05), ("camera on EPSON", 0.05)}
        ),
        *(
            Cell("slips up by 0.08", course, TAKEN_BACK, CONTRADICTED, at_write=slipped_up(0.08))
            for course in ("z-touch on EPSON", "z-touch, quick on EPSON", "z-touch, quick on PLC")
        ),
    ),
    *soak(
        Cell("bent by 1.9 degrees", "beams on EPSON", WITHIN, (), bent(1.9)),
        Cell("no noise in the latch", NO_NOISE, WITHIN),
        *(
            Cell(f"bent by {lean:g} degrees", course, WITHIN, BENT[lean], bent(lean), times=1.2)
            for lean in (0.5, 1.0, 1.9)
            for course in (
                "beams on EPSON",
                "beams on PLC",
                "beams once on EPSON",
                "beams once on PLC",
                "beams --turn on EPSON",
            )
        ),
        Cell("bent by 2.6 degrees", "beams on EPSON", REFUSED, ("bent_needle",), bent(2.6)),
        Cell("bent by 2.6 degrees", "beams once on EPSON", REFUSED, ("bent_needle",), bent(2.6)),
    ),
    Cell("always 0.05 beside", "two-pose on EPSON", WITHIN, (), beside(0.05)),
    Cell(
        "always 0.1 beside, stated",
        "n-angle on EPSON",
        WITHIN,
        (),
        beside(0.1),
        rows={"touch_mm": 0.1},
    ),
    *soak(
        Cell("always 0.05 beside", "n-angle on EPSON", WITHIN, (), beside(0.05), times=1.1),
        Cell("always 0.05 beside", "two-pose on PLC", WITHIN, (), beside(0.05), times=1.1),
        # Nothing in the cell shows it: the default covers half of it, and a recipe with a limit
        # that needs it refuses the default.
        Cell("always 0.1 beside", "two-pose on PLC", WITHIN, (), beside(0.1), times=2.0),
        Cell("always 0.1 beside", "n-angle on EPSON", WITHIN, (), beside(0.1), times=2.0),
    ),
    Cell("contact input, nothing wrong", BY_INPUT, WITHIN),
    *soak(
        # No row of its own; the usual scatter of a person covers half of it.
        Cell("always 0.05 beside, contact input", BY_INPUT, WITHIN, (), beside(0.05), times=2.0),
    ),
    Cell(
        "always 0.1 beside, limit 0.05",
        "two-pose on EPSON",
        REFUSED,
        OVER,
        beside(0.1),
        interval_mm=0.05,
    ),
    *soak(
        Cell(
            "0.2 lower, stated",
            "z-touch on EPSON",
            WITHIN,
            (),
            lambda _toward: wrong_by({"plate_mm": (-0.2,)}),
            rows={"plate_mm": 0.2},
        ),
        Cell(
            "0.2 lower",
            "z-touch on PLC",
            WITHIN,
            (),
            lambda _toward: wrong_by({"plate_mm": (-0.2,)}),
            times=2.0,
        ),
        Cell(
            "0.2 lower, limit 0.05",
            "z-touch on PLC",
            REFUSED,
            OVER,
            lambda _toward: wrong_by({"plate_mm": (-0.2,)}),
            interval_mm=0.05,
        ),
    ),
    Cell(
        "a spot that stands still",
        "camera on EPSON",
        REFUSED,
        STILL,
        faults(camera_still_share=1.0),
    ),
    *soak(
        *(
            Cell(
                "a spot that stands still",
                f"{method} on {kind}",
                REFUSED,
                STILL,
                faults(camera_still_share=1.0, camera_still_beside_px=beside_px),
            )
            for kind in ("EPSON", "PLC")
            for method in (
                "camera",
                "camera, quick",
                "camera, one look",
                "camera-affine",
                "runout-table",
                "board",
            )
            for beside_px in (0.0, 50.0)
        ),
    ),
)


LETS_PASS = {"two-pose": 1.9, "n-angle": 2.1, "plane-touch": 1.9}
"""The largest error in multiples of U where scatter is neither stated nor well shown by residuals:
a drift of 0.14 to 0.19 mm is within it.
"""


@pytest.mark.soak
@pytest.mark.parametrize(
    "course", [pytest.param(one, id=one.name) for one in BY_NAME.values() if one.proves]
)
def test_a_nozzle_that_slips_in_all_three_axes_is_seen_by_every_method(course):
    for seed, signs in enumerate(((1, 1, 1), (1, 1, -1), (-1, 1, 1), (-1, -1, -1)), start=11):
        by_mm = [sign * mm for sign, mm in zip(signs, (0.12, 0.06, 0.12), strict=True)]
        ended = change(course, seed, at_write=slips(*by_mm))
        if not ended.code and not ended.doubts:
            assert ended.share < LETS_PASS.get(course.method, 1.0), ended


def run(cell: Cell, seed: int):
    toward = random.Random(f"{cell.name} {seed}").uniform(0.0, math.tau)
    return change(
        cell.of,
        seed,
        wrong=cell.wrong(toward),
        at_write=cell.at_write(toward),
        rows=cell.rows,
        interval_mm=cell.interval_mm,
    )


def judge(cell: Cell, seed: int) -> None:
    ended = run(cell, seed)
    if cell.must == WITHIN:
        if ended.code and ended.code in cell.codes:
            return
        assert not ended.code, ended
        assert not ended.doubts, ended
        assert ended.share < cell.times, ended
        return
    assert ended.code in cell.codes, ended
    assert ended.taken_back is (cell.must == TAKEN_BACK), ended


@pytest.mark.parametrize(
    "cell",
    [
        pytest.param(cell, id=cell.name, marks=() if cell.each_time else pytest.mark.soak)
        for cell in CELLS
    ],
)
def test_a_cell_in_which_the_tip_is_wrong_ends_as_it_must(cell):
    judge(cell, 11)


@pytest.mark.parametrize(
    ("course", "misses", "less_mm"),
    [
        pytest.param("two-pose on EPSON", "", 0.1, id="two-pose"),
        pytest.param(BY_INPUT, "(X, Y)", 0.25, id="n-angle, contact input"),
        pytest.param("one-touch on EPSON", "(Z)", 0.4, id="one-touch"),
        pytest.param(ONE_BY_INPUT, "(X, Y, Z)", 0.1, id="one-touch, contact input"),
        pytest.param("beams on EPSON", "", 0.03, id="beams"),
        pytest.param(
            "beams once on EPSON", "(X, Y)", 0.032, id="beams once", marks=pytest.mark.soak
        ),
        pytest.param("camera, quick on EPSON", "", 0.0135, id="camera, quick"),
        pytest.param("z-touch on EPSON", "", 0.05, id="z-touch"),
    ],
)
def test_what_a_turn_test_would_not_show_is_said_where_it_is_more_than_is_stated(
    course, misses, less_mm
):
    ended = change(BY_NAME[course] if isinstance(course, str) else course, 11)
    assert not ended.code, ended
    assert ended.proof is not None
    assert ended.proposal is not None
    judgement = ended.proof.judgement
    assert judgement is not None
    told = [judgement.shows_from_mm, judgement.shows_z_from_mm]
    assert max(one for one in told if one) < less_mm, told
    assert not judgement.misses_z
    assert (judgement.shows_z_from_mm is not None) is ("z_mm" in ended.proposal.result.measured)
    said = [one for one in turn_test_sentences(judgement) if "may not show" in one]
    assert len(said) == bool(misses)
    assert all(misses in one for one in said), said


@pytest.mark.soak
@pytest.mark.parametrize("cell", [pytest.param(cell, id=cell.name) for cell in CELLS])
def test_so_it_does_under_other_seeds(cell):
    for seed in range(12, 18):
        judge(cell, seed)


@pytest.mark.soak
def test_of_a_plane_whose_contact_an_input_shows_nobody_sees_anything():
    def source(cell: Any, _rng: random.Random) -> Any:
        furnish(cell, contact_input=9)
        return PlaneTouchSource(
            TouchPlan(lift_mm=15.0, contact=InputEdge(9)), PlaneSurvey(10), axes=5
        )

    course = BY_NAME["plane-touch on PLC"]
    by_eye, by_input = change(course, 11), change(replace(course, source=source), 11)
    for ended, sees in ((by_eye, True), (by_input, False)):
        assert not ended.code
        assert ended.proposal is not None
        accuracy = ended.proposal.result.accuracy
        assert accuracy is not None
        assert ("touch_mm" in [row.key for row in accuracy.rows]) is sees
        assert ended.share < 1.2


# A person at the contradicted turn test.


@dataclass(frozen=True)
class AtTerminal:
    """A cell whose station was moved.

    Attributes:
        course: The method and its cell.
        moved: A shift that exceeds all stated rows.
        little: A shift that exceeds scatter, and stays within ``rows``.
        rows: The rows stated then.
        wider_mm: For the first shift: drift and scatter.
    """

    course: str
    moved: Callable[[Any], None]
    little: Callable[[Any], None]
    rows: dict[str, float]
    wider_mm: float


BEAMS = AtTerminal("beams on EPSON", moved(0.05)(1.0), moved(0.025)(2.0), {"place_mm": 0.05}, 0.107)
PIN = AtTerminal(
    "one-touch on EPSON", moved(0.075)(1.0), moved(0.04)(2.0), {"place_mm": 0.1}, 0.175
)
EACH = pytest.mark.parametrize(
    "at", [pytest.param(PIN, id="pin"), pytest.param(BEAMS, id="beams", marks=pytest.mark.soak)]
)
BOTH = pytest.mark.parametrize("at", [pytest.param(PIN, id="pin"), pytest.param(BEAMS, id="beams")])


WIDER = "Keep the value with a wider"
KEEPS = "Keep the value: it is"
AGAIN = "Make one more touch.", "Measure once more with the camera."


class Answers:
    """Chooses rows one after another by their beginnings, and keeps the questions."""

    def __init__(self, *rows: str):
        self.rows = list(rows)
        self.asked: list[str] = []

    def __call__(self) -> str:
        return self.rows.pop(0) if self.rows else ""


def at_a_terminal(at: AtTerminal, answers: Answers, *, little: bool = False, **more: Any):
    def person(cell: Any) -> Person:
        found = person_at(cell)
        found.chooses = answers
        found.asked = answers.asked
        return found

    return change(
        BY_NAME[at.course],
        11,
        wrong=at.little if little else at.moved,
        attended=True,
        person=person,
        rows=at.rows if little else None,
        **more,
    )


def rows_asked(answers: Answers) -> list[str]:
    """Return the questions with rows."""
    return [one for one in answers.asked if "What should happen now?" in one]


@EACH
def test_an_engineer_takes_the_wider_statement_and_it_holds(at):
    answers = Answers(WIDER)
    ended = at_a_terminal(at, answers, role="engineer")
    assert not ended.code
    assert "proof_contradicts_accuracy" in ended.doubts
    assert ended.accurate_mm == pytest.approx(at.wider_mm, abs=0.04)
    assert ended.share < 0.8, "the tip is inside, whichever of both it was"
    assert len(rows_asked(answers)) == 1


@pytest.mark.soak
@EACH
def test_an_operator_may_not_take_it_and_the_old_value_is_back(at):
    assert at_a_terminal(at, Answers(WIDER), role="operator").code == "NotAllowedError"


@EACH
def test_whoever_only_presses_enter_gets_the_old_value_back(at):
    answers = Answers()
    ended = at_a_terminal(at, answers, role="engineer")
    assert ended.code == "proof_contradicts_accuracy"
    assert ended.taken_back
    assert len(rows_asked(answers)) == 1


@EACH
def test_once_more_shows_a_station_that_was_moved_again_and_twice_at_most(at):
    more = next(row for row in AGAIN if row.startswith("Make" if at is PIN else "Measure"))
    answers = Answers(more, more, more)
    ended = at_a_terminal(at, answers)
    assert ended.code == "proof_contradicts_accuracy"
    assert ended.taken_back
    asked = rows_asked(answers)
    assert [more in one for one in asked] == [True, True, False]
    assert ended.proof is not None
    assert ended.proof.judgement is not None
    assert ended.proof.judgement.tests == 3
    assert {one.looks for one in ended.proof.drifts} == {3}


@pytest.mark.soak
def test_beyond_the_limit_of_the_process_it_is_not_offered():
    answers = Answers(WIDER)
    ended = at_a_terminal(BEAMS, answers, role="engineer", interval_mm=0.05)
    assert ended.taken_back
    assert not any(WIDER in one for one in answers.asked)


@EACH
def test_what_the_statement_covers_is_a_warning_without_a_person(at):
    ended = change(BY_NAME[at.course], 11, wrong=at.little, rows=at.rows)
    assert not ended.code
    assert ended.doubts == ("proof_contradicts_repeatability",)
    assert ended.share < 0.8


@pytest.mark.soak
@BOTH
@pytest.mark.parametrize("yes", [True, False])
def test_and_a_question_with_one(at, yes):
    answers = Answers(KEEPS if yes else "")
    ended = at_a_terminal(at, answers, little=True)
    assert sum(KEEPS in one for one in answers.asked) == 1
    assert ended.code == ("" if yes else "proof_contradicts_repeatability")
    assert ended.taken_back is not yes


@pytest.mark.soak
@pytest.mark.parametrize(
    "course", [pytest.param(one, id=one.name) for one in BY_NAME.values() if one.proves]
)
def test_every_method_turns_once_more_from_where_its_turn_test_has_ended(course):
    """A shift of 0.4 mm contradicts each; the process allows more, or it would refuse first."""
    at = AtTerminal(course.name, lambda _cell: None, lambda _cell: None, {}, 0.0)
    surface = course.method in ("plane-touch", "sphere-touch", "z-touch", "z-touch, quick")
    slip = slips(0.0, 0.0, 0.4) if surface else slips(0.4, -0.1)
    answers = Answers(" more ", " more ")  # one more touch, once more with the camera
    ended = at_a_terminal(at, answers, at_write=slip, drift_mm=1.0)
    assert ended.taken_back
    assert ended.proof is not None
    assert ended.proof.judgement is not None
    assert ended.proof.judgement.tests == 3, ended.code
