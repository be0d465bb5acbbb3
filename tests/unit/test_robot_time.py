"""What counts as the robot's time, and what is foreseen from it."""

from contextlib import nullcontext
from itertools import count
from types import SimpleNamespace

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.calibration_run import ChangePlan, Limits, NozzleChange, PlannedStep, ToolPlan
from robolink.calibration_run._forecast import RunForecaster, RunTimes, _like_s
from robolink.controllers import SimpleController
from robolink.journal import memory_journal
from robolink.methods import PointsSource
from robolink.model import EntryKind, MotionProfile, NewEntry, Path, Pose, Signature, WorkBox
from robolink.runner import Confirm, RobotTime, Runner, RunSettings
from robolink.timing import AnswerTimes
from tests._rows import each_row

PARKED, START, PLACE = (Pose(x, 0, 50, 0, tool=0) for x in (0, 300, 400))

_NUMBERS = count()
"""Each controller has a record of its own; an address may be that of an earlier one."""


class Controller:
    """A controller that answers after a while, and moves at 100 mm/s."""

    def __init__(self, answer_s=0.02):
        self.clock = ManualClock()
        self.answers = AnswerTimes(self.clock)
        self.answer_s = answer_s
        self.outcomes = memory_journal(f"robot-time-{next(_NUMBERS)}").log("a")
        self.outcomes.signature = Signature(recipe="needle", version="1")

    def ask(self, times=1):
        """Let requests be answered."""
        for _ in range(times):
            asked_ns = self.clock.now_ns()
            self.clock.sleep(self.answer_s)
            self.answers.answered(asked_ns)

    def move(self, time, start, target, journey=False):
        """Move, with three requests before it."""
        with time.journey_to(target) if journey else nullcontext():
            self.ask(3)
            time.stands = start
            with time.awaiting(target, Path.JOINT):
                self.clock.sleep(abs(target.x_mm - start.x_mm) / 100)


def linked(answer_s=0.02):
    """A controller; how its parts are typed does not matter here."""
    return Controller(answer_s)


def plan_of(**limits):
    return ChangePlan((ToolPlan(1),), Limits(WorkBox(), **limits), safe=START)


def step(start, target):
    return PlannedStep("", target, MotionProfile(Path.JOINT), start=start)


def forecaster(link, *, parked=PARKED, mode="change", work="w", further_mm=0, **limits):
    there = Pose(PLACE.x_mm + further_mm, 0, 50, 0, tool=0)
    steps = (*([step(parked, START)] if parked != START else ()), step(START, there))
    return RunForecaster(link, "needle", mode, work, plan_of(**limits), steps)


def run(link, *, parked=PARKED, unusual=False, **more):
    """One run, with a person who takes ten minutes; what it was foreseen to take, and took."""
    ahead = forecaster(link, parked=parked, **more)
    foreseen = ahead.forecast()
    time = RobotTime(link, START)
    link.clock.sleep(5)  # nothing that belongs to the run
    with time.counted():
        if parked != START:
            link.move(time, parked, START, journey=True)
        with time.person():
            link.ask(7)
            link.move(time, START, PLACE)
            link.clock.sleep(600)
        if unusual:
            time.unusual()
        link.move(time, START, PLACE)
    entry = ahead.entry(time, "c")
    if entry is not None:
        link.outcomes.append(entry)
    return foreseen, time


def test_a_person_and_what_comes_before_and_after_is_no_time_of_the_robot():
    _, time = run(linked())
    assert time.seconds == pytest.approx(3 + 1 + 6 * 0.02)
    assert time.journey.seconds == pytest.approx(3 + 3 * 0.02)
    assert [(one.length_mm, one.seconds) for one in time.moves] == [(300, 3), (100, 1)]


def test_answers_are_counted_anew_and_the_way_to_the_start_with_them():
    link = linked(0)
    run(link)
    link.answer_s = 0.1
    link.ask(64)
    foreseen, time = run(link, parked=Pose(150, 0, 50, 0, tool=0))
    assert foreseen.about_s == pytest.approx(time.seconds) == pytest.approx(1.5 + 1 + 0.6)
    assert foreseen.with_journey
    assert foreseen.runs == 1


def test_a_way_that_no_run_has_shown_is_left_out_and_that_is_said():
    link = linked()
    run(link, parked=START)
    foreseen, _ = run(link)
    assert not foreseen.with_journey
    assert foreseen.about_s == pytest.approx(1.06)
    assert "not counting its move to the start" in foreseen.sentence
    again, time = run(link)
    assert again.with_journey
    assert again.about_s == pytest.approx(time.seconds)


def test_a_run_of_other_movements_or_of_another_kind_tells_nothing():
    link = linked()
    run(link)
    found = forecaster(link, work="other").forecast()
    assert (found.about_s, found.changed) == (None, True)
    assert "changed since the last run" in found.sentence
    found = forecaster(link, mode="reference").forecast()
    assert (found.about_s, found.changed) == (None, False)
    # The digest holds the speed; for the move to the start it has to be looked at again.
    assert not forecaster(link, speed_percent=9).forecast().with_journey


def test_a_longer_way_tells_nothing_and_another_nozzle_is_no_other_way():
    link = linked()
    run(link)
    assert forecaster(link, further_mm=4).forecast().about_s is not None
    assert forecaster(link, further_mm=40).forecast().about_s is None


def test_a_run_in_which_something_was_repeated_is_not_recorded():
    link = linked()
    run(link, unusual=True)
    assert forecaster(link).forecast().about_s is None
    assert not forecaster(link).forecast().changed


@each_row("details", [{}, {"times": None}, {"times": {"schema": "a/1"}}])
def test_an_entry_of_another_form_is_passed_over(details):
    link = linked()
    run(link)
    link.outcomes.append(NewEntry(EntryKind.RUN, details=details))
    assert forecaster(link).forecast().runs == 1
    newest = next(link.outcomes.recorded())
    assert RunTimes.recorded(newest) is None


def test_without_an_answer_time_a_run_counts_as_it_was():
    link = linked()
    run(link)
    link.answers = None
    assert forecaster(link, parked=START).forecast().about_s == pytest.approx(1.06)


def test_nothing_is_said_where_nothing_moves():
    link = linked()
    link.plan = SimpleNamespace(moves=False)
    assert RunForecaster(link, "needle", "change", "w", link.plan, ()).forecast() is None


@pytest.mark.parametrize("answer", ["y", "n"])
def test_an_offer_that_is_accepted_makes_a_run_unusual(answer):
    controller = SimpleController(identity=f"offer-{answer}")
    person = SimpleNamespace(ask=lambda *_: None, tell=lambda *_: None, poll=lambda _: answer)
    runner = Runner(controller, controller.groups[0], person, RunSettings(WorkBox()))

    def course():
        yield Confirm("One more touch?")

    runner.run(course())
    assert runner.robot_time.usual is (answer == "n")


def test_a_measurement_that_is_made_again_makes_a_run_unusual():
    touches = iter([[PLACE, PLACE], [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]])
    plan = ToolPlan(1, source=PointsSource(lambda: next(touches)), verify=False, attempts=2)
    nobody = SimpleNamespace(tell=lambda *_: None)
    with SimpleController(identity="made-again") as controller:
        time = RobotTime(controller)
        change = NozzleChange(
            controller,
            ChangePlan((plan,), ask_before_write=False),
            operator=nobody,
            robot_time=time,
        )
        change.run(write=False)
    assert not time.usual


def like_s(turn_deg, length_mm=0.0, path=Path.JOINT):
    """How long a turn takes by two others, of which the larger one led 30 mm far."""
    moves = [("joint", 0.0, 10.0, 0.4), ("joint", 30.0, 40.0, 0.8)]
    return _like_s(moves, path, (length_mm, turn_deg), 20.0)


def test_a_larger_turn_is_followed_from_two_that_differ():
    assert like_s(25) == pytest.approx(0.6)
    assert like_s(100) == pytest.approx(0.8 + 60 * 0.4 / 30)
    assert like_s(121) is None
    assert like_s(100, path=Path.STRAIGHT) is None
    assert _like_s([("joint", 0.0, 40.0, 0.8)], Path.JOINT, (0.0, 100.0), 20.0) is None


def test_a_way_beside_a_turn_counts_only_if_none_as_long_took_less():
    assert like_s(40, length_mm=30) == pytest.approx(0.8)
    assert like_s(40, length_mm=50) is None
    assert like_s(10, length_mm=30) is None
