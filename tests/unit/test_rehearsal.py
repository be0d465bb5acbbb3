"""A procedure is gone through beforehand as it will go if the tip is where it is expected."""

import math
from types import SimpleNamespace

import pytest

from robolink.calibration import Beam
from robolink.calibration_run import ChangePlan, ToolPlan
from robolink.calibration_run._preview import rehearse
from robolink.controllers import AnswerCounts, SimpleController
from robolink.errors import CalibrationError
from robolink.methods import BeamsParameters, measure_beams
from robolink.model import InputEdge, MotionProfile, Path, Pose, ToolOffset
from robolink.runner import Ask, Confirm, Look, Move, Rehearsal, RehearsedKind, Seek
from robolink.stations import BeamStation
from robolink.testing import PaperCell

HERE = Pose(300, 100, 20, 0, tool=0)
LOW = Pose(300, 100, 0, 0, tool=0)
TIP = ToolOffset(12, -4, -20)
SPEEDS = MotionProfile(Path.JOINT, 5, 50)
BEAMS = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4))


class Times:
    """A second for a movement, two for a search, and nobody knows how fast joints are."""

    answers = AnswerCounts(run=10, tool=5, select=3, move=2, search=4)

    def __init__(self, joint_s=None):
        self.joint_s = joint_s
        self.ways = []

    def move_s(self, way):
        self.ways.append(way)
        return 1.0 if way.profile.path is Path.STRAIGHT else self.joint_s

    def search_s(self, way):
        self.ways.append(way)
        return 2.0


def course():
    """One of each step."""
    yield Move(LOW, Path.STRAIGHT, "Down.")
    found = yield Seek(HERE, InputEdge(3), 5, "Looking.", expected=Pose(300, 100, 12, 0, tool=0))
    seen = yield Look("Looking.", (300.0, 80.0))
    assert (seen.spot.x, seen.spot.y) == (300, 80)
    assert (yield Confirm("Once more?")) is False
    yield Ask("Touch.", foreseen=LOW)
    yield Move(HERE, Path.JOINT, "Back.")
    return found.z_mm


def test_a_search_ends_where_its_edge_is_expected_and_no_farther():
    rehearsal = Rehearsal(HERE)
    assert rehearsal.run(course()) == 12
    _, search, *_ = rehearsal.steps
    assert (search.end.z_mm, search.farthest.z_mm, search.speed_mm_s) == (12, 20, 5)
    assert [step.kind.value for step in rehearsal.steps] == ["move", "search", "look", "move"]
    assert rehearsal.here == HERE


def test_a_search_of_which_nobody_expects_anything_goes_to_its_end():
    rehearsal = Rehearsal(HERE)

    def searching():
        return (yield Seek(LOW, InputEdge(3), 5, "Looking."))

    assert rehearsal.run(searching()) == LOW


def test_what_is_not_known_is_counted_and_left_out():
    rehearsal, times = Rehearsal(HERE), Times()
    rehearsal.settle_s = 0.5
    rehearsal.run(course())
    told = rehearsal.takes(times, SPEEDS, tools=2)
    assert (told.seconds, told.left_out) == (1 + 2 + 0.5, 1)
    assert told.answers == 10 + 2 * 5 + 2 + 4 + 1 + 2
    assert [way.profile.speed_mm_s for way in times.ways] == [50, 5, 50]
    known = rehearsal.takes(Times(), SPEEDS, tools=2, otherwise=lambda path, _way: 4.0)
    assert (known.seconds, known.left_out) == (7.5, 0)


def test_another_frame_is_timed_by_where_the_flange_goes():
    rehearsal, times = Rehearsal(HERE), Times(joint_s=1.0)

    def turning():
        yield Move(Pose(300, 100, 20, 180, tool=1), Path.JOINT, "Turning.")

    rehearsal.select(Pose(300, 100, 20, 0, tool=1), ToolOffset(10))
    rehearsal.run(turning())
    rehearsal.takes(times, SPEEDS, tools=1)
    (way,) = times.ways
    assert (way.length_mm, way.turn_deg) == (0, 180)
    assert (way.start.x_mm, way.end.x_mm) == pytest.approx((290, 310))
    assert rehearsal.steps[0].kind is RehearsedKind.SELECT


def test_beams_are_gone_through_as_a_tip_in_its_place_goes_through_them():
    plan = BeamsParameters(repeats=1, search_mm=1.5, aside_mm=1.6)
    rehearsal = Rehearsal(HERE)
    found = rehearsal.run(measure_beams(BEAMS, plan, here=HERE, stored=TIP, run_up_mm=0.1))
    assert found.offset.x_mm == pytest.approx(TIP.x_mm, abs=0.2)
    on = {3: lambda at: abs(at[1] - 80) < 0.5, 4: lambda at: abs(at[0] - 300) < 0.5}
    cell = PaperCell(HERE, TIP, switches=on)
    cell.run(measure_beams(BEAMS, plan, here=HERE, stored=TIP, run_up_mm=0.1))
    real = [step for step in cell.steps if isinstance(step, (Move, Seek))]
    rehearsed = [step for step in rehearsal.steps if step.goes]
    assert [step.purpose for step in rehearsed] == [step.purpose for step in real]


def test_a_procedure_that_makes_nothing_of_what_is_expected_is_closed():
    closed = []

    def refusing():
        try:
            yield Move(LOW, Path.STRAIGHT, "Down.")
            raise CalibrationError("rank_deficient", "No.")
        finally:
            closed.append(True)

    with pytest.raises(CalibrationError, match="No"):
        Rehearsal(HERE).run(refusing())
    assert closed


class Reaching:
    """A group whose arm gets as far as a circle about its axis."""

    def __init__(self, reach_mm):
        self.reach_mm = reach_mm
        self.asked = []

    def pose(self):
        return HERE

    def reaches(self, target):
        self.asked.append(target)
        return math.hypot(target.x_mm, target.y_mm) <= self.reach_mm


def turned(reach_mm):
    """A rehearsed turn test at 310 mm, and the controller whose arm is asked."""
    rehearsal, group = Rehearsal(HERE), Reaching(reach_mm)
    rehearsal.select(Pose(310, 0, 0, 0, tool=1), ToolOffset(10))

    def turning():
        yield Move(Pose(310, 0, 50, 90, tool=1), Path.JOINT, "Above.")
        yield Move(Pose(310, 0, 0, 90, tool=1), Path.STRAIGHT, "Down.")
        yield Move(Pose(310, 0, 0, 180, tool=1), Path.JOINT, "Half a turn.")

    rehearsal.run(turning())
    return rehearsal, SimpleNamespace(groups=(group,), tools=None)


def test_what_the_arm_reaches_is_asked_once_a_place():
    rehearsal, cell = turned(330)
    assert rehearsal.beyond_reach(cell, 2) is None
    assert [round(at.x_mm) for at in cell.groups[0].asked] == [310, 310, 320]


def test_a_place_that_another_tip_reaches_is_none_to_refuse():
    # The flange stands at 320 mm with the tip turned by half a turn.
    rehearsal, cell = turned(318.5)
    assert rehearsal.beyond_reach(cell, 2) is None
    for slack_mm in (0, 1):
        rehearsal, cell = turned(318.5)
        far = rehearsal.beyond_reach(cell, slack_mm)
        assert far is not None
        assert far.purpose == "Half a turn."


def test_places_that_no_single_tip_reaches_together_are_refused():
    # To the one side the tip would have to be longer, to the other shorter.
    rehearsal, cell = turned(319.5)

    def turning_back():
        yield Move(Pose(330, 0, 0, 0, tool=1), Path.JOINT, "Back.")

    rehearsal.run(turning_back())
    assert rehearsal.beyond_reach(cell, 1) is not None


def test_an_arm_that_cannot_tell_is_not_asked():
    rehearsal, _ = turned(0)
    assert rehearsal.beyond_reach(SimpleNamespace(groups=(object(),)), 1) is None


class Broken:
    """A method of another package, which makes nothing of what is expected."""

    sentence = remedy = ""
    clearance_mm = None

    def procedure(self, stored, here):
        yield Move(LOW, Path.STRAIGHT, "Down.")
        raise ZeroDivisionError

    def measure(self, context, tool, stored):
        raise NotImplementedError

    def verify(self, context, tool, result, *, tip, tolerance_mm):
        raise NotImplementedError


def test_a_method_that_breaks_at_expected_answers_does_not_end_a_run_that_could_work():
    plan = ChangePlan((ToolPlan(1, source=Broken()),))
    with SimpleController(identity="rehearsal-broken") as controller:
        assert rehearse(controller, plan, here=HERE, stored={1: TIP}) is None
