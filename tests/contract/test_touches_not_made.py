"""Touches that were answered but not made: every way to touch a pin, on both controller kinds.

The nozzle was changed by some tenths of a millimetre before. What the person really does is hidden
in the simulated world, so only the procedures can find out.
"""

import math

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes, perform

import robolink
from robolink.calibration_run import AcceptanceCriteria, ChangePlan, NozzleChange, ToolPlan
from robolink.errors import CalibrationError, VerifyError
from robolink.methods import NAngleSource, TwoPoseSource
from robolink.model import EntryKind
from robolink.procedures import TouchPlan
from robolink.runner import TouchedAt
from tests.contract._method_cell import method_cell, on
from tests.contract.test_calibrate_pivot import plc, run, slot

__all__ = ["plc"]

pytestmark = pytest.mark.simulator_only

CONTACT = 7
LONG = pytest.mark.soak
RECIPE = """
schema = "robolink/recipe/1"
name = "a nozzle on a pin"
basis = "absolute"
z = "kept"
[source]
kind = "{kind}"
[station]
id = "PIN-07"
[[tools]]
number = 1
[speeds]
percent = 100
mm_s = 100
"""


@pytest.fixture
def cell(kind, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        cell.lengthen(0.0, 0.4, -0.3)
        yield cell


@pytest.fixture
def arm(arm):
    arm.lengthen(0.0, 0.4, -0.3)
    return arm


def has_habit(cell, **habits):
    """Give the person at the cell another habit."""
    perform(cell.cell.simulator, {"do": "set_world", **habits})


def check_refused(cell, done, code, *, exit_code=7):
    """Check that the command was refused, nothing was written, and the record gives the reason."""
    assert (done.code, done.document["error"]["code"]) == (exit_code, code), done.err
    assert (cell.stored.x_mm, cell.stored.y_mm) == (12.0, -3.5)
    assert cell.recorded(EntryKind.REFUSED)[0].details["code"] == code


@pytest.mark.parametrize(
    ("kind", "method", "true_touches"),
    [
        ("plc", "two-pose", 0),
        ("epson", "n-angle", 1),
        pytest.param("epson", "two-pose", 0, marks=pytest.mark.soak),
        pytest.param("plc", "n-angle", 1, marks=pytest.mark.soak),
    ],
)
def test_enter_alone_is_refused_and_nothing_is_proposed(cell, method, true_touches):
    has_habit(cell, person_stays_share=1, person_stays_from_touch=1 + true_touches)
    done = cell.calibrate(method)
    check_refused(cell, done, "not_touched")
    assert "Touch 2 was not made: the robot is where it stopped" in done.err
    assert cell.recorded(EntryKind.INTENT, EntryKind.CALIBRATION) == []


@pytest.mark.parametrize("kind", on("epson"))
def test_enter_alone_is_refused_in_a_recipe_too(cell, tmp_path):
    has_habit(cell, person_stays_share=1)
    path = tmp_path / "recipe.toml"
    path.write_text(RECIPE.format(kind="n-angle"))
    done = cell.run("recalibrate", str(path), "--assist", cell.cell.url, "--yes", "--json")
    check_refused(cell, done, "not_touched")


@pytest.mark.parametrize("kind", on("plc"))
def test_enter_alone_in_the_proof_brings_the_old_value_back(cell):
    has_habit(cell, person_stays_share=1, person_stays_from_touch=3)
    done = cell.calibrate("two-pose")
    check_refused(cell, done, "not_touched", exit_code=8)
    assert "The new tip was not tested:\n    Touch 1 was not made" in done.document["error"]["what"]
    assert cell.recorded(EntryKind.ROLLED_BACK)


@pytest.mark.parametrize("kind", on("epson"))
def test_enter_alone_is_refused_by_one_touch(cell):
    words = ("--station", "PIN-07", "--count", "3", "--no-verify")
    assert cell.calibrate("n-angle", *words).code == 0
    known = cell.stored
    cell.lengthen(0.4, 0.3, -0.2)
    has_habit(cell, person_stays_share=1)
    done = cell.calibrate("one-touch", "--station", "PIN-07")
    assert (done.code, done.document["error"]["code"]) == (7, "not_touched")
    assert cell.stored == known


@pytest.mark.parametrize("kind", on("epson"))
def test_enter_alone_teaches_no_station(cell):
    has_habit(cell, person_stays_share=1)
    words = ("--tool", "1", "--assist", cell.cell.url, "--yes", "--json")
    done = cell.run("station", "learn", "PIN-07", *words)
    assert (done.code, done.document["error"]["code"]) == (7, "not_touched")
    assert cell.recorded(EntryKind.STATION) == []


def test_a_station_that_was_touched_once_only_is_not_taught(arm):
    """The first answer was given beside the pin, the second on it."""
    has_habit(arm, person_stays_share=1)
    answers = iter((1.0, 0.0))
    ask = arm.world.operator.begin_touch

    def begin_touch(tool=None):
        has_habit(arm, person_stays_share=next(answers, 0.0))
        return ask(tool)

    arm.world.operator.begin_touch = begin_touch
    words = ("--tool", "1", "--assist", arm.cell.url, "--yes", "--json")
    done = arm.run("station", "learn", "PIN-07", *words)
    assert done.document["error"]["code"] in ("touch_heights_differ", "touch_not_proven")
    assert arm.recorded(EntryKind.STATION) == []


@pytest.mark.parametrize(
    "true_touches", [pytest.param(0, marks=LONG), 1, pytest.param(4, marks=LONG)]
)
def test_enter_alone_is_refused_by_a_pivot_and_its_proof(plc, true_touches):
    tip = plc.world.tips[1]
    before = slot(plc)
    share = {"person_stays_share": 1, "person_stays_from_touch": 1 + true_touches}
    perform(plc, {"do": "set_world", **share})
    words = ("calibrate", "pivot", "--tool", "1", "--assist", plc.url, "--yes", "--count", "4")
    code, document, _ = run(plc.url, *words)
    assert document["error"]["code"] == "not_touched"
    assert code == (8 if true_touches == 4 else 7)
    assert slot(plc) == before
    assert tip == plc.world.tips[1]


@pytest.mark.parametrize("kind", on("epson"))
def test_an_answer_typed_ahead_is_asked_again_and_the_tip_is_the_true_one(cell):
    has_habit(cell, person_types_ahead=True)
    done = cell.calibrate("two-pose")
    assert done.code == 0, done.err
    assert "before the question could be read" in done.err
    assert cell.stored.x_mm == pytest.approx(cell.truth.x_mm, abs=0.05)
    assert cell.stored.y_mm == pytest.approx(cell.truth.y_mm, abs=0.05)


def test_who_always_answers_too_early_is_refused(arm):
    has_habit(arm, person_thinks_s=0)
    done = arm.calibrate("n-angle")
    check_refused(arm, done, "typed_ahead")


def test_a_pin_that_is_bumped_half_way_is_refused_before_the_proposal(arm):
    has_habit(arm, pin_bumped_after_touch=3, pin_bump_mm=0.6)
    check_refused(arm, arm.calibrate("n-angle", "--count", "5"), "large_residual")


def test_a_pin_that_is_bumped_between_two_touches_shows_in_the_proof(arm):
    has_habit(arm, pin_bumped_after_touch=1, pin_bump_mm=0.6)
    done = arm.calibrate("two-pose")
    assert (done.code, done.document["error"]["code"]) == (8, "large_drift")
    assert (arm.stored.x_mm, arm.stored.y_mm) == (12.0, -3.5)


class SameJog(AssistedOperator):
    """Brings the tip to the pin once, and types the same jog ever after."""

    jog = "z-2"
    asked = 0

    @classmethod
    def at(cls, cell, controller):
        """Return the person at a cell."""
        eyes = InProcessEyes(cell.cell.simulator)
        return cls.with_eyes(eyes, lambda _: None, clock=controller.clock)

    def ask(self, question, kind):
        super().ask(question, kind)
        self.asked += 1
        self.words = None

    def poll(self, wait_s):
        word = super().poll(wait_s)
        if self.asked == 1 or word is None:
            return word
        if self.words is None:
            # The jogs end in a fine step, as required, where they began.
            self.words = [self.later(), "z+0.1", "z-0.1", ""]
        return self.words.pop(0) if self.words else ""

    def later(self):
        """Return the words typed at each touch but the first."""
        return self.jog


JOGS = [(TwoPoseSource(), "z-2"), (NAngleSource((180.0, 90.0, -90.0)), "x+0.1 z-2")]


@pytest.mark.parametrize(
    ("kind", "source", "jog"),
    [
        pytest.param("epson", *JOGS[0], id="epson-two-pose"),
        pytest.param("plc", *JOGS[1], id="plc-n-angle", marks=pytest.mark.soak),
        pytest.param("plc", *JOGS[0], id="plc-two-pose", marks=pytest.mark.soak),
        pytest.param("epson", *JOGS[1], id="epson-n-angle", marks=pytest.mark.soak),
    ],
)
def test_the_same_jog_each_time_is_refused_from_the_python_api(cell, source, jog):
    with robolink.connect(cell.cell.url) as controller:
        person = SameJog.at(cell, controller)
        person.jog = jog
        plan = ChangePlan((ToolPlan(1, source),), ask_before_write=False)
        with pytest.raises((CalibrationError, VerifyError)) as refused:
            NozzleChange(controller, plan, operator=person).run()
        # The one height drawn for a second touch may equal the jogged one: then the turn test shows
        # it.
        assert "touch_heights_differ" in vars(refused.value).values()
        assert isinstance(refused.value, CalibrationError) or isinstance(source, TwoPoseSource)
    assert (cell.stored.x_mm, cell.stored.y_mm) == (12.0, -3.5)


class DownOnly(SameJog):
    """Moves down to the height of the pin each time, but beside it."""

    def later(self):
        _, _, dz_mm = self._look()
        return f"z{dz_mm:+.3f}"


@pytest.mark.parametrize(
    ("source", "kind", "codes"),
    [
        (TwoPoseSource(), VerifyError, {"large_drift"}),
        (
            NAngleSource((180.0, 90.0, -90.0)),
            CalibrationError,
            # The first touch was on the pin, so it may be the one that does not fit.
            {"touch_not_proven", "large_residual"},
        ),
    ],
    ids=["two-pose", "n-angle"],
)
def test_the_right_height_beside_the_pin_is_no_touch(arm, source, kind, codes):
    with robolink.connect(arm.cell.url) as controller:
        plan = ChangePlan((ToolPlan(1, source),), ask_before_write=False)
        with pytest.raises(kind) as refused:
            NozzleChange(controller, plan, operator=DownOnly.at(arm, controller)).run()
        assert refused.value.code in codes
    assert (arm.stored.x_mm, arm.stored.y_mm) == (12.0, -3.5)


@pytest.mark.parametrize("kind", on("epson"))
def test_a_touch_at_a_perfect_stored_offset_is_taken_as_it_is(cell):
    cell.world.tips[1] = cell.stored
    done = cell.calibrate("n-angle", "--count", "3")
    assert done.code == 0, done.err
    assert "not made" not in done.err
    (entry,) = cell.recorded(EntryKind.CALIBRATION)
    first, *others = entry.details["touches"]
    assert (first["arrival"], first["jog_mm"]) == (None, None)
    # With a perfect offset only the standoff is left to jog; the error is a few hundredths.
    assert all(
        touch["jog_mm"] == pytest.approx(math.hypot(*touch["standoff_mm"]), abs=0.3)
        for touch in others
    )
    assert all(touch["answered_s"] > 0.3 for touch in others)
    assert entry.details["standoff_seed"] is not None
    (proof,) = cell.recorded(EntryKind.VERIFY)
    assert len(proof.details["touches"]) == 2


def test_the_standoffs_of_two_runs_differ_unless_the_seed_is_given(arm):
    def standoffs(seed):
        with robolink.connect(arm.cell.url) as controller:
            source = NAngleSource((180.0,), TouchPlan(seed=seed))
            plan = ChangePlan((ToolPlan(1, source, verify=False),), ask_before_write=False)
            eyes = InProcessEyes(arm.cell.simulator)
            person = AssistedOperator.with_eyes(eyes, lambda _: None, clock=controller.clock)
            (report,) = NozzleChange(controller, plan, operator=person).run().tools
        poses = report.proposal.result.inputs
        return [pose.standoff_mm for pose in poses if isinstance(pose, TouchedAt)]

    assert standoffs(None) != standoffs(None)
    assert standoffs(5) == standoffs(5)


@pytest.mark.parametrize("kind", on("epson"))
def test_a_contact_input_counts_and_takes_the_sideways_part_away(cell):
    has_habit(cell, contact_input=CONTACT, person_presses_mm=0.03, eye_sigma_mm=0.02)
    words = ("--count", "3", "--contact-input", str(CONTACT), "--no-verify")
    done = cell.calibrate("n-angle", *words)
    assert done.code == 0, done.err
    (entry,) = cell.recorded(EntryKind.CALIBRATION)
    others = entry.details["touches"][1:]
    assert all(touch["contact"] for touch in others)
    assert all(touch["standoff_mm"][:2] == [0.0, 0.0] for touch in others)
    assert all(touch["standoff_mm"][2] >= 2.0 for touch in others)
    assert cell.stored.x_mm == pytest.approx(cell.truth.x_mm, abs=0.08)


@pytest.mark.parametrize(
    ("wired", "words"),
    [
        ({"contact_input": CONTACT, "person_stays_share": 1}, ("--contact-input", str(CONTACT))),
        ({}, ("--contact-input", str(CONTACT))),
        ({}, ("--contact-input", str(CONTACT), "--off-in-contact")),
    ],
    ids=["enter only", "never on", "stuck in contact"],
)
def test_an_input_that_does_not_go_over_is_no_contact(arm, wired, words):
    has_habit(arm, **wired)
    done = arm.calibrate("n-angle", *words)
    check_refused(arm, done, "not_touched")
    assert f"input {CONTACT} did not go over to contact" in done.err


@pytest.mark.parametrize("method", ["two-pose", "n-angle", "one-touch"])
def test_a_clearance_below_the_largest_change_is_refused_before_anything_moves(arm, method):
    station = ("--station", "PIN-07") if method == "one-touch" else ()
    done = arm.calibrate(method, "--clearance", "1", *station)
    assert (done.code, done.document["error"]["kind"]) == (2, "ConfigError")
    assert "would stop 1 mm from contact" in done.document["error"]["what"]
    assert arm.cell.simulator.machine.arm.moves_started == 0


def test_a_clearance_is_refused_in_the_same_words_from_recipe_and_script(arm, tmp_path):
    said = arm.calibrate("two-pose", "--clearance", "1").document["error"]["what"]
    path = tmp_path / "recipe.toml"
    kind = 'two-pose"\nclearance_mm = 1 #'
    path.write_text(RECIPE.format(kind=kind).replace('#"', ""))
    done = arm.run("recalibrate", str(path), "--assist", arm.cell.url, "--yes", "--json")
    assert (done.code, done.document["error"]["what"]) == (2, said)
    with robolink.connect(arm.cell.url) as controller:
        one = ToolPlan(1, TwoPoseSource(TouchPlan(clearance_mm=1)), AcceptanceCriteria())
        with pytest.raises(robolink.errors.ConfigError) as refused:
            NozzleChange(controller, ChangePlan((one,)), operator=SameJog.at(arm, controller)).run()
    assert refused.value.what == said
    assert arm.cell.simulator.machine.arm.moves_started == 0
