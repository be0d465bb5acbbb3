"""A contradicted turn test after a break asks the same question as during the change."""

from contextlib import contextmanager
from dataclasses import replace

import pytest

from robolink.accuracy import learning_commands
from robolink.calibration import AccuracyFacts, ErrorSource, assessed, solve_two_pose
from robolink.calibration_run import ToolPlan, finish_by_turn_test, open_turn_tests
from robolink.calibration_run._turn_test import relearning_commands
from robolink.controllers import SimpleController
from robolink.errors import NotAllowedError, RobolinkError, VerifyError
from robolink.methods import BeamsSource
from robolink.model import EntryKind, Pose, ToolOffset
from robolink.report import reports_of
from robolink.runner import Question
from robolink.stations import Found, StationKind, station_entry
from robolink.transaction import recover
from tests.certificate.live import BEAM_NOISE, row_of, wrong_by
from tests.contract._sensor_cell import TOOL, sensor_cell
from tests.contract.test_proof_after_a_break import Later
from tests.packaging.test_documented_examples import problem

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(60)]

WIDER, AGAIN = "Keep the value with a wider", "Measure once more with the camera."
POWER_GOES = "(the power goes)"


class Broken(Later):
    """A change by beams that moved, cut off when its value was written."""

    choices: tuple[str, ...] = ()
    role = ""
    old: ToolOffset | None = None
    new: ToolOffset | None = None

    @contextmanager
    def connected(self):
        with super().connected() as controller:
            if self.role:
                outcomes = controller.outcomes
                outcomes.signature = replace(outcomes.signature, operator="Kim", role=self.role)
            yield controller

    def person(self):
        later, found = self, super().person()
        poll = found.poll

        def chosen(wait_s):
            if found._kind is not Question.CHOICE:
                return poll(wait_s)
            wanted, later.choices = (*later.choices, "")[0], later.choices[1:]
            if wanted == POWER_GOES:
                later.cell.simulator.panel.cut_link()
                return None
            return row_of(later.asked[-1], wanted) or ""

        found.poll = chosen
        return found

    def asked_to_finish(self, *choices, attended=True):
        self.choices = choices
        with self.connected() as controller:
            (operation,) = open_turn_tests(controller)
            recover(controller, keep=True, confirm=lambda _finding: True, later=[operation])
            finish_by_turn_test(controller, operation, self.person(), attended=attended)

    def now(self):
        with self.connected() as controller:
            return controller.tools.read(TOOL), controller.outcomes.open_markers()

    def entries(self, *kinds):
        log = self.journal.log(self.cell.url, clock=self.cell.clock)
        return [*log.recorded(kinds=kinds)][::-1]


@pytest.fixture
def broken(tmp_path):
    with sensor_cell(5) as cell:
        cell.mount_beams(cell.beams(radius_mm=0.1), **BEAM_NOISE)
        later = Broken(cell, tmp_path)
        later.old, _ = later.now()
        wrong_by({"place_mm": (0.03, 0.04)})(cell)
        later.broken_off(BeamsSource(cell.station))
        later.new, markers = later.now()
        assert markers
        yield later


def test_whoever_only_presses_enter_gets_the_old_value_back(broken):
    with pytest.raises(VerifyError) as refused:
        broken.asked_to_finish("")
    assert refused.value.code == "proof_contradicts_accuracy"
    assert broken.now() == (broken.old, ())
    assert sum("What should happen now?" in one for one in broken.asked) == 1


def test_where_nobody_may_be_asked_nobody_is(broken):
    with pytest.raises(VerifyError):
        broken.asked_to_finish(attended=False)
    assert broken.now() == (broken.old, ())
    assert broken.asked == []


def test_a_wider_statement_is_taken_after_a_break_too_and_is_on_record(broken):
    broken.asked_to_finish(WIDER)
    assert broken.now() == (broken.new, ())
    (done,) = broken.entries(EntryKind.DONE)
    assert done.details["accurate_to_mm"] == pytest.approx(0.107, abs=0.02)
    (chosen,) = [e for e in broken.entries(EntryKind.DECISION) if e.details.get("chosen")]
    assert chosen.details["chosen"] == "wider"
    assert chosen.change == done.change
    about = {"made_at": "", "robolink_version": "", "check": ""}
    (report,) = reports_of([e for e in broken.entries() if e.change == done.change], **about)
    assert report.widened_mm == done.details["accurate_to_mm"]


@pytest.mark.soak
def test_an_operator_may_not_take_it_there_either(broken):
    broken.role = "operator"
    with pytest.raises(NotAllowedError):
        broken.asked_to_finish(WIDER)
    assert broken.now() == (broken.old, ())


@pytest.mark.soak
def test_looking_once_more_after_a_break_counts_all_looks(broken):
    with pytest.raises(VerifyError) as refused:
        broken.asked_to_finish(AGAIN, AGAIN, AGAIN)
    assert refused.value.code == "proof_contradicts_accuracy"
    entries = broken.entries(EntryKind.VERIFY)
    assert [one.details["judgement"]["tests"] for one in entries] == [1, 2, 3]
    assert [AGAIN in one for one in broken.asked if "happen now" in one] == [True, True, False]


def test_ending_the_process_at_the_question_is_no_way_to_a_fresh_test(broken):
    """The looks before the power failure count, although the beams are corrected meanwhile."""
    with pytest.raises(RobolinkError):
        broken.asked_to_finish(POWER_GOES)
    assert broken.now()[1], "the change is open"
    wrong_by({"place_mm": (-0.03, -0.04)})(broken.cell)
    with pytest.raises(VerifyError) as refused:
        broken.asked_to_finish("")
    assert refused.value.code.startswith("proof_contradicts_")
    last = broken.entries(EntryKind.VERIFY)[-1]
    assert last.details["judgement"]["tests"] == 2
    assert last.details["judgement"]["apart_mm"] > 0.05
    assert broken.now() == (broken.old, ())


@pytest.mark.parametrize(
    ("kind", "known", "commands"),
    [
        (StationKind.BEAMS, 15, ["cell station learn 'B 2' --tool 15"]),
        (
            StationKind.BEAMS,
            None,
            ["calibrate two-pose --tool 1", "cell station learn 'B 2' --tool 1"],
        ),
        (StationKind.TOUCH, 15, ["cell station learn 'B 2' --tool 15"]),
        (StationKind.TOUCH, None, []),
        (StationKind.PIN, 15, ["calibrate n-angle --station 'B 2' --tool 1"]),
        (StationKind.CAMERA, None, ["calibrate camera-affine --station 'B 2' --tool 1"]),
    ],
)
def test_the_commands_that_learn_a_station_again_can_be_typed(kind, known, commands):
    found = learning_commands("B 2", kind, tool=1, known_tool=known)
    assert [*found] == commands
    assert [problem(f"robolink {one}") for one in found] == [None] * len(found)


@pytest.mark.parametrize(
    ("by", "commands"),
    [
        (None, ("calibrate two-pose --tool 1", "cell station learn BEAMS-02 --tool 1")),
        (1, ("calibrate two-pose --tool 1", "cell station learn BEAMS-02 --tool 1")),
        (9, ("cell station learn BEAMS-02 --tool 9",)),
    ],
)
def test_a_station_is_learnt_with_another_tool_than_the_one_in_doubt(by, commands):
    controller = SimpleController(identity=f"relearning-{by}")
    if by is not None:
        found = Found(id="BEAMS-02", kind=StationKind.BEAMS, x_mm=1.0, y_mm=2.0, tool=by)
        controller.outcomes.append(station_entry(found))
    touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
    plain = solve_two_pose(*touches, sigma_mm=0.01)
    place = (ErrorSource.of_lengths("place_mm", 2, turning="in_base"),)
    rests = assessed(replace(plain, method="beams", sources=place), AccuracyFacts())
    assert relearning_commands(controller, ToolPlan(1, at="BEAMS-02"), rests) == commands
    assert relearning_commands(controller, ToolPlan(1), rests) == (), "it has no name"
    alone = assessed(plain, AccuracyFacts())
    assert relearning_commands(controller, ToolPlan(1, pin="PIN-07"), alone) == (), "no place"
