"""A procedure is gone through beforehand as it will go if the tip is where it is expected."""

import pytest

from robolink.calibration import Beam
from robolink.controllers import AnswerCounts
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
