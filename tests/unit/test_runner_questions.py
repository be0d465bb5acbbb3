"""Questions of a procedure: possible answers, their timing, and what ends them."""

import os
import re
import sys
from itertools import count, cycle
from typing import cast

import pytest
from robolink_cli.prompts.operator import MOST_STEPS, AssistedOperator, TerminalOperator
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink.calibration import CalibrationResult
from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Listener,
    Moment,
    NozzleChange,
    Proposal,
    ToolPlan,
)
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import CalibrationError, ConfigError, DeclinedError, LimitError
from robolink.methods import PointsSource
from robolink.model import ControllerStatus, Path, Pose, ToolOffset, WorkBox
from robolink.runner import (
    MOST_REFUSED,
    Ask,
    EndingWatch,
    Operator,
    Question,
    Runner,
    RunSettings,
    ask_for_pose,
    jog_target,
    parse_steps,
    yes_or_no,
)
from robolink.runner._jog_steps import typed_pose
from tests._rows import each_row

# Possible answers of a person, the forms of a jog step, and an end to every question.

_names = count()


class Typist:
    """Types lines, the last one for ever, and keeps the output."""

    def __init__(self, *lines):
        self.lines, self.shown, self.asked, self.polled = list(lines), [], [], 0

    def tell(self, text):
        self.shown.append(text)

    def ask(self, question, kind):
        self.asked.append((question, kind))

    def poll(self, wait_s):
        self.polled += 1
        assert self.polled < 1000, "it is asked for ever"
        return self.lines.pop(0) if len(self.lines) > 1 else self.lines[0]


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=3)
    name = f"runner-questions-{next(_names)}"
    register(name, simulator)
    yield simulator
    unregister(name)


@pytest.fixture
def controller(simulator):
    with robolink.connect(simulator.url) as controller:
        yield controller


def runner_with(controller, operator, *, below_mm=10.0):
    group = controller.groups[0]
    box = WorkBox.around(group.pose(), xy_mm=10, below_mm=below_mm, above_mm=10)
    return Runner(controller, group, operator, RunSettings(box))


@each_row("word", ["y", "YES", "j", "Ja", " y ", "是"])
def test_these_are_a_yes(word):
    assert yes_or_no(word) is True


@each_row("word", ["n", "No", "nein", "NEIN", "否"])
def test_these_are_a_no(word):
    assert yes_or_no(word) is False


@each_row("word", ["", "4006381333931", "yy", "jo", "1", "ok"])
def test_anything_else_is_neither(word):
    assert yes_or_no(word) is None


@pytest.mark.parametrize(
    ("lines", "accepted", "asked"),
    [
        (["y"], True, 1),
        (["n", "y"], False, 1),
        (["4006381333931", "ja"], True, 2),
        (["", "nein"], False, 2),
        (["", "", "y"], False, 2),
    ],
)
def test_what_is_neither_is_asked_once_more_and_is_a_no_then(controller, lines, accepted, asked):
    typist = Typist(*lines)
    assert runner_with(controller, typist).confirm("Write it?") is accepted
    assert typist.asked == [("Write it?", Question.YES_NO)] * asked
    assert len(typist.shown) == asked - 1


@each_row(
    ("text", "deltas"),
    [
        ("x + 0.1", {"x": 0.1}),
        ("x +0.1 y-0.5", {"x": 0.1, "y": -0.5}),
        ("X+1,Y-2", {"x": 1.0, "y": -2.0}),
        ("x+0.5, z-0.25", {"x": 0.5, "z": -0.25}),
        ("z\u22120.1", {"z": -0.1}),
        ("\uff58\uff0b\uff10\uff0e\uff11\u3000\uff59\uff0d\uff11", {"x": 0.1, "y": -1.0}),
    ],
)
def test_a_step_is_understood_however_it_is_spaced_and_signed(text, deltas):
    assert parse_steps(text) == deltas


@each_row(
    "text",
    ["x0.1", "x+0.1\u00b2", "x+0.1234", "x+0.1.2", "x+1,  5", "+x1", "x+", "x+-1", "y"],
)
def test_what_could_be_meant_otherwise_is_not_guessed(text):
    with pytest.raises(
        ConfigError,
        match=r"is not a step\. A step is x\+0\.1: axis, sign, number, with a point\. Nothing",
    ):
        parse_steps(text)


@each_row(
    ("text", "pointed"),
    [
        ("x+0,1", "x+0.1"),
        ("X + 0,1", "x + 0.1"),
        ("x+0.5, z-0,25", "x+0.5, z-0.25"),
        ("\uff58\uff0b\uff10\uff0c\uff11", "x+0.1"),
        ("x+1,5", "x+1.5"),
    ],
)
def test_a_decimal_comma_is_refused_with_the_step_as_it_is_to_be_written(text, pointed):
    said = f"Write the decimal point as '.': {pointed}. Nothing moved."
    with pytest.raises(ConfigError, match=f"^{re.escape(said)}"):
        parse_steps(text)


@each_row("text", ["x+1 x+2", "z-5 z-5", "x+1 y-1 x-1"])
def test_an_axis_that_is_there_twice_is_named(text):
    with pytest.raises(ConfigError, match=f"^{text[0]} appears twice\\. Nothing moved"):
        parse_steps(text)


def test_after_each_jog_a_person_reads_that_it_is_done_how_far_and_where(controller):
    typist = Typist("x + 0.5 z-1", "u+2", "")
    before = controller.groups[0].pose()
    after = runner_with(controller, typist).run(ask_for_pose("Jog."))
    assert len(typist.shown) == 2
    moved, turned = typist.shown
    assert moved.startswith("  done: moved 1.1"), moved
    assert f"X {before.x_mm + 0.5:.1f}" in moved
    assert "turned +2.0" in turned
    assert after.z_mm == pytest.approx(before.z_mm - 1.0, abs=0.05)


def test_steps_that_are_refused_in_a_row_end_the_question_and_move_nothing(simulator, controller):
    typist = Typist("z-5", "z-5", "z-5", "z-5", "z-5")
    with pytest.raises(DeclinedError, match=f"{MOST_REFUSED} jogs in a row were refused") as ended:
        runner_with(controller, typist, below_mm=7).run(ask_for_pose("Jog."))
    _, _, remedy = ended.value.what.split("\n    ")
    assert typist.shown[-1].endswith(f". {remedy}"), "what to do about the last jog is not lost"
    assert simulator.machine.arm.moves_started == 1
    assert typist.polled == 1 + MOST_REFUSED


def test_a_step_that_is_taken_makes_up_for_mistakes(controller):
    lines = [*["oops"] * (MOST_REFUSED - 1), "z+0.1"] * 3
    runner_with(controller, Typist(*lines, "")).run(ask_for_pose("Jog."))


def test_a_text_that_never_comes_ends_the_question(controller):
    with pytest.raises(DeclinedError, match="Nothing was typed"):
        runner_with(controller, Typist("")).ask_text("Which lot?")


def test_a_stand_in_that_sees_another_way_each_time_gives_up():
    seen = cycle([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)])
    operator = AssistedOperator(lambda: next(seen), lambda _text: None)
    operator.ask("Onto the pin.", Question.PLACE)
    with pytest.raises(DeclinedError, match="did not reach the pin"):
        for _ in range(MOST_STEPS + 1):
            operator.poll(0)


def test_what_was_fed_in_before_a_question_answers_none_and_what_comes_after_does(monkeypatch):
    far, near = os.pipe()
    shown: list[str] = []
    with open(far) as stdin, open(near, "w", buffering=1) as feed:
        monkeypatch.setattr(sys, "stdin", stdin)
        operator = TerminalOperator(shown.append)
        feed.write("y\n\nz-2\n")
        operator.ask("Write it?", Question.YES_NO)
        assert operator.poll(0.05) is None
        assert [line for line in shown if line.startswith("Typed too early")] == [
            "Typed too early and ignored: 'y'",
            "Typed too early and ignored: 'z-2'",
        ]
        feed.write("n\n")
        assert operator.poll(20) == "n\n"
        feed.close()
        with pytest.raises(DeclinedError):
            operator.poll(20)


class Hasty(Typist):
    """Reads some questions and not others, by a clock."""

    def __init__(self, clock, *thinks_s):
        super().__init__("")
        self.clock, self.thinks_s = clock, list(thinks_s)

    def poll(self, wait_s):
        if self.thinks_s:
            self.clock.sleep(self.thinks_s.pop(0))
        return super().poll(wait_s)


def shown_to(controller, *thinks_s):
    hasty = Hasty(controller.clock, *thinks_s)
    return hasty, runner_with(controller, hasty).run(touched())


def touched():
    """Ask for a place on which a measurement rests."""
    return (yield Ask("Jog the tip onto the pin."))


def test_an_answer_that_nobody_can_have_read_the_question_for_is_asked_again(controller):
    hasty, answer = shown_to(controller, 0.0, 0.2, 0.4)
    assert len(hasty.asked) == 3
    assert len(hasty.shown) == 2
    assert answer.seconds == pytest.approx(0.4, abs=0.05)
    assert answer.contact is None


def test_whoever_keeps_answering_too_early_is_refused(controller):
    with pytest.raises(CalibrationError, match="too early for anybody to have read it") as refused:
        shown_to(controller, 0.0, 0.1, 0.2, 1.0)
    assert refused.value.code == "typed_ahead"


def test_a_jog_for_its_own_sake_needs_no_time(controller):
    runner_with(controller, Hasty(controller.clock, 0.0)).run(ask_for_pose("Jog."))


# Events that end a procedure while a person is asked.

ON = ControllerStatus(remote=True, ready=True)


@pytest.mark.parametrize("how", ["unpowered", "disabled"])
def test_drives_that_lost_their_power_end_it_and_those_without_any_do_not(how):
    off = ControllerStatus(remote=True, **{how: True})
    watch = EndingWatch()
    assert watch.obstacle(off) == "", "a person moves the machine in another way"
    assert watch.obstacle(ON) == ""
    assert watch.obstacle(off) == "The motors went off."


def test_what_says_why_is_said_first():
    watch = EndingWatch()
    assert watch.obstacle(ON) == ""
    pressed = ControllerStatus(emergency_stop=True, unpowered=True)
    assert watch.obstacle(pressed) == "The emergency stop was pressed."


# Jog steps and poses as a person types them: what is refused before anything moves.

HERE = Pose(300.0, 100.0, -60.0, 30.0, tool=0)
SETTINGS = RunSettings(WorkBox(), max_jog_mm=5.0, max_jog_deg=10.0)


@each_row(
    ("steps", "path", "coordinates"),
    [
        ("x+5 y-5, z+0.1", Path.STRAIGHT, (305.0, 95.0, -59.9, 30.0)),
        ("u-10", Path.JOINT, (300.0, 100.0, -60.0, 20.0)),
        ("x+1 u+8", Path.JOINT, (301.0, 100.0, -60.0, 38.0)),
    ],
)
def test_where_steps_lead_and_that_a_turn_is_no_straight_move(steps, path, coordinates):
    target, way = jog_target(HERE, steps, SETTINGS)
    assert way is path
    assert target.coordinates()[:4] == pytest.approx(coordinates)


@each_row("steps", ["x+5.1", "x-5.1", "z-6", "u+10.5", "u-11", "x+1 y-7"])
def test_a_step_too_long_is_refused_either_way(steps):
    with pytest.raises(LimitError):
        jog_target(HERE, steps, SETTINGS)


@each_row("axis", "xyzu")
@each_row("sign", "+-")
def test_a_decimal_comma_is_refused_at_each_axis_and_said_how_to_write_it(axis, sign):
    """Taken for two steps it would move by the first digit alone."""
    with pytest.raises(ConfigError) as refused:
        parse_steps(f"{axis}{sign}0,5")
    assert f"{axis}{sign}0.5" in refused.value.what


@each_row(
    "text",
    ["300.2 100 -60 30", "300 100 -60 31.5", "300 100 -60 30 1.5 0", "301.1 100 -60 30"],
)
def test_a_typed_pose_is_about_where_the_frame_is_and_in_its_box(text):
    settings = RunSettings(WorkBox(x_max_mm=300.1))
    assert typed_pose("300.05 100 -60 30", HERE, settings).x_mm == 300.05
    with pytest.raises(LimitError):
        typed_pose(text, HERE, settings)


# A recipe's prompts and outputs between the phases of a change come in their place, once.

OLD = ToolOffset(12, -3.5, -20)
TOUCHES = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]


class Noting(Listener):
    """Records each moment with the tool's value then; may refuse at one."""

    def __init__(self, machine, *, refuses=None):
        self.machine, self.refuses, self.seen = machine, refuses, []

    def moment(self, moment, context, tool=None):
        self.seen.append((moment, tool, self.machine.read(1) == OLD))
        if moment is self.refuses:
            raise DeclinedError("no")


def run(machine, listener, *, write=True):
    tool = ToolPlan(1, source=PointsSource(lambda: TOUCHES), verify=False)
    plan = ChangePlan((tool,), ask_before_write=False)
    with SimpleController(machine) as controller:
        return NozzleChange(controller, plan, operator=cast(Operator, None), listener=listener).run(
            write=write
        )


def test_each_moment_comes_once_and_the_one_before_the_write_before_it():
    machine = SimpleMachine({1: OLD})
    listener = Noting(machine)
    run(machine, listener)
    assert listener.seen == [
        (Moment.START, None, True),
        (Moment.BEFORE_MEASURE, 1, True),
        (Moment.AFTER_MEASURE, 1, True),
        (Moment.BEFORE_WRITE, None, True),
        (Moment.END, None, False),
    ]


def test_what_is_not_written_has_no_moment_before_it():
    machine = SimpleMachine({1: OLD})
    listener = Noting(machine)
    run(machine, listener, write=False)
    assert Moment.BEFORE_WRITE not in [moment for moment, _, _ in listener.seen]
    assert machine.read(1) == OLD


@each_row("refuses", [Moment.START, Moment.BEFORE_MEASURE, Moment.BEFORE_WRITE])
def test_who_refuses_at_a_moment_before_the_write_keeps_the_old_value(refuses):
    machine = SimpleMachine({1: OLD})
    with pytest.raises(DeclinedError):
        run(machine, Noting(machine, refuses=refuses))
    assert machine.read(1) == OLD


# The part of a proposal that counts as its change: the measured lengths.

BEFORE = ToolOffset(12.0, -3.5, -20.0)
XY, XYZ = ("x_mm", "y_mm"), ("x_mm", "y_mm", "z_mm")


def proposal(offset, measured, z_from="kept"):
    result = CalibrationResult(
        method="pivot",
        offset=offset,
        measured=measured,
        kept=tuple(name for name in XYZ if name not in measured),
        reference_point_mm=(),
        sigma_gain=1.0,
        warnings=(),
        inputs=(),
    )
    return Proposal(1, BEFORE, result, z_from=z_from)


@each_row(
    ("measured", "z_from", "change_mm"),
    [
        (("z_mm",), "kept", 3.0),
        (XYZ, "kept", 3.0),
        (XY, "measured", 3.0),
        (XY, "typed", 0.0),
        (XYZ, "typed", 0.0),
    ],
)
def test_a_jump_of_z_alone_is_implausible_where_z_was_measured(measured, z_from, change_mm):
    longer = proposal(ToolOffset(12.0, -3.5, -23.0), measured, z_from)
    assert longer.change_mm == pytest.approx(change_mm)
    if not change_mm:
        AcceptanceCriteria().judge_change(longer)
        return
    with pytest.raises(CalibrationError, match="would move 3") as refused:
        AcceptanceCriteria().judge_change(longer)
    assert refused.value.code == "implausible_change"


def test_the_lengths_count_together_and_only_the_plane_has_to_shrink():
    both = proposal(ToolOffset(12.6, -4.3, -21.0), XYZ)
    assert both.change_mm == pytest.approx(2**0.5)
    AcceptanceCriteria().judge_change(both, earlier_mm=[1.1])
    with pytest.raises(CalibrationError, match="The correction grew"):
        AcceptanceCriteria().judge_change(both, earlier_mm=[0.9])
