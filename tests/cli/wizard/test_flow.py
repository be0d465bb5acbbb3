"""The wizard's flow: the effect of keys and lines, and effects that they never have."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli.wizard.happenings import (
    HasEnded,
    KeyPressed,
    LineTyped,
    Reading,
    TooFast,
    WaitsForAnswer,
    WasAsked,
    WasRead,
    WasRegarded,
    WasTold,
    WizardCommand,
)
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.screens.sentences import told_question
from robolink_cli.wizard.state import STEP_SIZES, CheckPoint, ChoiceSubject, LastScreen, Mark
from robolink_cli.wizard.views.place import instruction

from robolink.model import Path as Way
from robolink.model import Pose
from robolink.runner import JogSubject, MoveSubject, Question
from tests.cli.wizard._people import (
    ARRIVAL,
    CHECK,
    Sitting,
    contradicted,
    fit_subject,
    touch_subject,
    write_subject,
)

CHOICES = ("The old one.", "The new one.", "I am not sure.")


def at_touch(**more):
    return Sitting().asked(touch_subject(**more))


def test_a_first_touch_that_the_robot_went_to_by_itself_is_jogged_too():
    brought = Sitting().asked(touch_subject(number=1, arrival=None)).keys("5")
    assert brought.sent == ["done"], (
        "a tip that was on the pin before anything moved is taken as it is"
    )
    going = MoveSubject(ARRIVAL, Way.JOINT, 20.0, "Moving to the station for tool 1.")
    carried = Sitting().happens(WasRegarded(going)).asked(touch_subject(number=1, arrival=None))
    carried.keys("5")
    assert "is still where the robot stopped" in carried.state.message
    assert not carried.sent
    carried.keys("3").jogs("z-0.1").keys("5")
    assert carried.sent == ["z-0.1", "done"]


def test_a_touch_is_jogged_in_coarse_steps_and_taken_after_a_fine_one():
    hand = at_touch()
    hand.key("main")
    assert "is still where the robot stopped" in hand.state.message
    hand.keys("+", "+", "3")
    assert hand.sent == ["z-1"]
    hand.jogs("z-1.0").keys("5")
    assert "the last step was 1.00 mm" in hand.state.message
    hand.keys("-", "-", "3")
    assert hand.sent == ["z-1", "z-0.1"]
    hand.jogs("z-0.1").keys("5")
    assert hand.sent == ["z-1", "z-0.1", "done"]


def test_what_is_pressed_while_the_robot_moves_is_dropped():
    hand = at_touch().keys("6", "6", "6", "8", "5")
    assert hand.sent == ["x+0.1"]
    hand.jogs("x+0.1")
    assert hand.sent == ["x+0.1"]


def test_a_take_right_after_a_step_is_not_meant_for_it():
    hand = at_touch().keys("6")
    hand.now += 0.5
    hand.waits()
    hand.now += 0.1
    hand.keys("5")
    assert hand.state.message == "Wait: the robot is still moving."
    assert hand.sent == ["x+0.1"]


@pytest.mark.parametrize("quarters", range(4))
def test_turned_keys_still_name_what_they_do(quarters):
    hand = at_touch()
    for _ in range(quarters):
        hand.key("tab")
    rows = "\n".join(screen_of(hand.state, hand.now).lines)
    for key in "6842":
        axis = rows[rows.index(f"[{key}] ") + 4 :][:2]
        other = at_touch()
        for _ in range(quarters):
            other.key("tab")
        other.keys(key)
        assert other.sent == [f"{axis.lower()}0.1"], (key, rows)


def test_enter_takes_writes_and_starts_nothing():
    assert at_touch(arrival=None).key("enter").sent == []
    assert at_touch(arrival=None).line("").sent == []
    hand = Sitting().asked(write_subject(1), Question.YES_NO).keys("1")
    assert hand.key("enter").sent == []
    hand = Sitting().asked(CHECK, Question.YES_NO)
    for key in ("2", "5", "2", "5", "2", "2"):  # each row, and the one that starts
        assert hand.keys(key).key("enter").sent == []
        assert "ENTER does nothing here" in hand.state.message


def test_no_key_answers_before_its_question_could_be_seen():
    hand = Sitting()
    hand.happens(WasRegarded(touch_subject(arrival=None)))
    hand.happens(WasAsked(1, "?", Question.PLACE, 10.0)).happens(WaitsForAnswer(1, 10.0))
    hand.now = 10.2
    assert hand.keys("6", "5").sent == []
    hand.now = 10.4
    assert hand.keys("6").sent == ["x+0.1"]


@pytest.mark.parametrize(
    ("typed", "sent"),
    [
        ("1*", "y"),
        ("12*", None),
        ("*", None),
        ("2*", None),
        ("n", "n"),
    ],
)
def test_a_write_takes_the_number_of_the_tool(typed, sent):
    hand = Sitting().asked(write_subject(1), Question.YES_NO).keys(*typed)
    assert hand.sent == ([sent] if sent else [])
    assert sent or "Nothing was written" in hand.state.message
    assert sent or hand.state.typed == ""


def test_the_numbers_of_several_tools_are_typed_all():
    assert Sitting().asked(write_subject(1, 12), Question.YES_NO).keys(*"1*").sent == []
    assert Sitting().asked(write_subject(1, 12), Question.YES_NO).keys(*"112*").sent == ["y"]
    assert Sitting().asked(write_subject(1, 12), Question.YES_NO).line("1, 12").sent == ["y"]


def test_a_start_waits_for_every_point_of_the_list():
    hand = Sitting().asked(CHECK, Question.YES_NO).keys("5")
    assert hand.sent == []
    assert "Mark a row first." in hand.state.message
    assert hand.keys("8", "5").sent == []
    assert hand.state.message == "Not yet: 3 open."
    assert hand.line("y").state.message == "Not yet. First: 1, 2, 3."
    assert hand.keys("8", "8", "5", "8", "5").line("y").sent == []
    assert hand.state.message == "Not yet. First: 3."
    assert hand.keys("2", "2", "5").sent == ["motors"]
    done = replace(CHECK, points=CHECK.points[:3])
    hand = Sitting().asked(done, Question.YES_NO).keys("2", "5", "2", "5", "2", "5")
    assert hand.sent == ["y"]
    # A person who returns to the cell confirms the row again.
    hand = Sitting().asked(done, Question.YES_NO).keys("2", "5", "2", "5", "5", "2", "5")
    assert hand.sent == []
    assert hand.state.message == "Not yet: 1 open."
    assert Sitting().asked(done, Question.YES_NO).line("1").line("2").line("y").sent == ["y"]


def test_a_list_that_changes_under_the_finger_has_no_mark_any_more():
    ready = replace(CHECK, points=(*CHECK.points[:3], CheckPoint(Mark.OK, "Motors are on")))
    hand = Sitting().asked(CHECK, Question.YES_NO).keys("2", "5", "2", "5", "2")
    hand.happens(WasRegarded(ready))  # somebody else switched them on
    assert hand.keys("5").sent == []
    hand = Sitting().asked(ready, Question.YES_NO).keys("2", "5", "2", "5", "2")
    hand.happens(WasRegarded(CHECK))  # they went off again
    assert hand.keys("5").sent == []
    assert hand.keys("2", "5").sent == ["motors"]


@pytest.mark.parametrize("pressed", [1, 2, 3, 40])
def test_a_main_key_that_is_held_down_never_starts(pressed):
    hand = Sitting().asked(replace(CHECK, points=CHECK.points[:3]), Question.YES_NO)
    assert hand.keys(*["5"] * pressed).sent == []
    assert hand.keys("2", *["5"] * pressed).sent == []
    assert len(hand.state.checked) <= 1


def test_the_worst_touch_is_offered_first_only_where_it_stands_out():
    far, near = fit_subject(0.006, 0.08, 0.004, worst=1), fit_subject(0.02, 0.03, 0.02, worst=1)
    for fit, first in ((far, "/"), (near, "5")):
        hand = Sitting().asked(fit, Question.YES_NO)
        assert screen_of(hand.state, hand.now).actions[0][0] == first
        assert hand.keys("5").sent == ["n"]
        assert Sitting().asked(fit, Question.YES_NO).keys("/").sent == ["y"]
        assert Sitting().asked(fit, Question.YES_NO).keys("enter", "+", "1", "3").sent == []


@pytest.mark.parametrize(
    ("subject", "kind", "sent"),
    [
        (touch_subject(), Question.PLACE, "q"),
        (None, Question.TEXT, "q"),
        (write_subject(1), Question.YES_NO, "n"),
        (CHECK, Question.YES_NO, "n"),
        (None, Question.YES_NO, WizardCommand.END_WORK),
        (fit_subject(0.1, 0.01, 0.01, worst=0), Question.YES_NO, WizardCommand.END_WORK),
    ],
)
def test_stop_ends_without_a_question_wherever_it_is_pressed(subject, kind, sent):
    assert Sitting().asked(subject, kind).key("stop").key("stop").sent == [sent]
    hand = Sitting().asked(subject, kind)
    hand.key("main" if kind is Question.PLACE else "enter")
    busy = Sitting()
    assert busy.key("stop").sent == [WizardCommand.END_WORK]


def test_a_text_takes_digits_and_ends_with_enter():
    hand = Sitting().asked(None, Question.TEXT).keys(*"N-0418")
    hand.key("backspace").keys("9").key("enter")
    assert hand.sent == ["N-0419"]
    assert Sitting().asked(None, Question.TEXT).key("enter").sent == []


@pytest.mark.parametrize("word", ["take", "记录", " TAKE ", "\uff54\uff41\uff4b\uff45"])
def test_words_of_both_languages_take(word):
    assert at_touch(arrival=None).line(word).sent == ["done"]


@pytest.mark.parametrize(
    ("line", "sent", "message"),
    [
        ("again 1", "again", ""),
        ("重做", "again", ""),
        ("停止", "q", "Stopping."),
        ("x+0,1", None, "Write the decimal point as '.': x+0.1. Nothing moved."),
        ("x+0.1 z-0.5", "x+0.1 z-0.5", ""),
        ("\uff58\uff0b\uff10\uff0e\uff11", "x+0.1", ""),
    ],
)
def test_lines_at_a_touch(line, sent, message):
    hand = at_touch().line(line)
    assert hand.sent == ([sent] if sent else [])
    assert hand.state.message == message
    assert "take records" in at_touch().line("帮助").state.message


@pytest.mark.parametrize(
    ("line", "sent"),
    [("/", "again 3"), ("again 1", "again 1"), ("again", "again 3"), ("again 4", None)],
)
def test_one_earlier_touch_is_made_again_where_the_method_hears_it(line, sent):
    hand = at_touch(number=4, retakes=True)
    hand = hand.keys("/") if line == "/" else hand.line(line)
    assert hand.sent == ([sent] if sent else [])
    assert sent or hand.state.message == "Touch 4 was not made yet."


@pytest.mark.parametrize(
    ("again", "adds", "typed", "sent"),
    [
        (3, True, "/", "back"),
        (3, True, "+", "more"),
        (3, False, "+", None),
        (None, True, "/", None),
        (None, True, "+", None),
    ],
)
def test_from_the_new_values_one_key_goes_back_to_the_touches(again, adds, typed, sent):
    subject = replace(write_subject(1), again=again, can_add_touch=adds)
    assert Sitting().asked(subject, Question.YES_NO).keys(typed).sent == ([sent] if sent else [])
    words = {"/": "back", "+": "more"}
    line = Sitting().asked(subject, Question.YES_NO).line(words[typed])
    assert line.sent == ([sent] if sent else [])


def test_one_more_touch_is_offered_beside_the_worst():
    first = replace(fit_subject(0.006, 0.08, 0.004, worst=1), more=True)
    later = replace(fit_subject(0.02, 0.03, 0.02, worst=1), more=True)
    for fit in (first, later):
        for key, sent in {"5": "n", "+": "more", "/": "y"}.items():
            assert Sitting().asked(fit, Question.YES_NO).keys(key).sent == [sent]
        assert Sitting().asked(fit, Question.YES_NO).line("再触碰").sent == ["more"]
        assert Sitting().asked(fit, Question.YES_NO).line("again").sent == ["y"]


def test_the_first_touch_and_the_turn_test_are_not_begun_again():
    assert at_touch(number=1, arrival=None).keys("/").sent == []
    assert at_touch(limit_mm=0.2).keys("/").sent == []
    assert at_touch().keys("/").sent == ["again"]


def test_a_reading_that_is_old_takes_no_touch():
    hand = at_touch().keys("6")
    hand.jogs("x+0.1")
    hand.now += 2.0
    hand.keys("5")
    assert hand.state.message == "No reading from the controller for 2 s."


@pytest.mark.parametrize(
    ("done", "key", "effect"),
    [
        (True, "5", WizardCommand.LEAVE),
        (True, "0", WizardCommand.LEAVE),
        (True, "enter", None),
        (True, ".", WizardCommand.SHOW_REPORT),
        (True, "delete", WizardCommand.SHOW_REPORT),
        (True, "+", WizardCommand.NEXT_TOOL),
        (True, "1", None),
        (True, "3", None),
        (False, ".", None),
        (False, "+", None),
        (False, "5", WizardCommand.BEGIN_AGAIN),
        (False, "stop", WizardCommand.LEAVE),
        (False, "enter", None),
        (False, "6", None),
    ],
)
def test_the_last_screen_is_left_by_its_keys_alone_and_not_by_one_that_is_held(done, key, effect):
    offers = frozenset((WizardCommand.SHOW_REPORT, WizardCommand.NEXT_TOOL))
    hand = at_touch()
    hand.state = replace(hand.state, offers=offers)
    hand.happens(HasEnded(LastScreen(done, ("line",), (), hand.now)))
    hand.now += 0.2
    assert hand.keys(key).sent == []
    hand.now += 0.2
    assert hand.keys(key).sent == ([effect] if effect else [])
    assert hand.state.wants is effect


def test_the_last_screen_takes_only_what_it_offers_typed_words_too():
    for offers in ((), (WizardCommand.SHOW_REPORT,), (WizardCommand.NEXT_TOOL,)):
        for key, word, chinese, wanted in (
            (".", "report", "报告", WizardCommand.SHOW_REPORT),
            ("+", "Next", "下一个", WizardCommand.NEXT_TOOL),
        ):
            for act in (
                lambda hand, key=key: hand.keys(key),
                lambda hand, word=word: hand.line(word),
                lambda hand, word=chinese: hand.line(word),
            ):
                hand = at_touch()
                hand.state = replace(hand.state, offers=frozenset(offers))
                hand.happens(HasEnded(LastScreen(True, ("line",), (), hand.now)))
                hand.now += 1.0
                assert act(hand).sent == ([wanted] if wanted in offers else [])
    hand = at_touch().happens(HasEnded(LastScreen(True, ("line",), (), 0.0)))
    for nothing in ("", "  ", "take", "y", "N-0418"):
        assert hand.line(nothing).sent == [], nothing
    assert hand.line("finish").sent == [WizardCommand.LEAVE]


def test_a_pose_is_typed_into_a_field_that_enter_only_closes():
    hand = at_touch(types=True).keys(".").keys(*"250.1 199.9 -83.5 90")
    assert hand.sent == []
    assert hand.state.typing
    hand.key("enter")
    assert (hand.sent, hand.state.typing) == ([], False)
    assert "Typed: 250.1 199.9 -83.5 90." in hand.state.message
    assert hand.keys("5").sent == ["pose 250.1 199.9 -83.5 90"]
    line = at_touch(types=True).line("pose 250.1 199.9 -83.5 90")
    assert line.sent == []
    assert line.line("take").sent == ["pose 250.1 199.9 -83.5 90"]


def test_a_typed_pose_is_gone_after_a_step_and_where_none_is_taken():
    hand = at_touch(types=True).line("pose 1 2 3 4").keys("6")
    assert hand.jogs("x+0.1").keys("5").sent == ["x+0.1", "done"]
    assert at_touch().keys(".").state.message == "You cannot type a pose here."
    assert at_touch().line("pose 1 2 3 4").state.pose_typed == ""
    three = at_touch(types=True).line("pose 1 2 3")
    assert "Nothing was recorded." in three.state.message
    assert three.keys("5").sent == []
    assert at_touch(types=True).keys(".").key("stop").sent == ["q"]


def test_nothing_of_one_touch_counts_for_the_next():
    """Neither a pose that was typed and not accepted, nor the steps made."""
    hand = at_touch(types=True).jogs("z-0.1").line("pose 1 2 3 4")
    hand.asked(touch_subject(types=True)).keys("5")
    assert hand.sent == []
    assert "is still where the robot stopped" in hand.state.message
    going = MoveSubject(ARRIVAL, Way.JOINT, 20.0, "Moving to the station for tool 2.")
    hand = at_touch().jogs("z-0.1").happens(WasRegarded(going))
    hand.asked(touch_subject(number=1, arrival=None)).keys("5")
    assert hand.sent == []


def test_a_line_while_the_robot_moves_is_no_step():
    assert at_touch().line("x+0.1").line("x+0.1").sent == ["x+0.1"]


NAMES = [*"0123456789+-*/nyqt. ", "main", "stop", "enter", "backspace", "tab", "delete"]
WORDS = [
    "take",
    "done",
    "again",
    "y",
    "n",
    "1",
    "",
    "x+0.1",
    "z-2",
    "stop",
    "记录",
    "12",
    "back",
    "more",
]
SUBJECTS = [
    (touch_subject(), Question.PLACE),
    (touch_subject(arrival=None, number=1), Question.PLACE),
    (write_subject(1), Question.YES_NO),
    (replace(write_subject(3), again=2, can_add_touch=True), Question.YES_NO),
    (touch_subject(retakes=True, types=True), Question.PLACE),
    (CHECK, Question.YES_NO),
    (fit_subject(0.1, 0.01, worst=0), Question.YES_NO),
    (None, Question.YES_NO),
    (None, Question.TEXT),
]
HAPPENINGS = st.one_of(
    st.builds(lambda name: ("key", name), st.sampled_from(NAMES)),
    st.builds(lambda word: ("line", word), st.sampled_from(WORDS)),
    st.builds(lambda index: ("ask", index), st.integers(0, len(SUBJECTS) - 1)),
    st.builds(lambda by: ("jogged", by), st.sampled_from([0.0, 0.01, 0.1, 1.0])),
    st.sampled_from([("waits", 0), ("told", 0), ("fast", 0), ("time", 0.01), ("time", 0.5)]),
)


def check_history(history, first):
    """Nothing is accepted without a jog or written without typing, whatever the order of events."""
    hand, pose, moved, digits, lined, posed = Sitting(), ARRIVAL, 0.0, "", "", False
    hand.asked(*SUBJECTS[first])
    for what, of in history:
        before = len(hand.sent)
        state = hand.state
        if what == "key":
            digits = digits + of if of.isdigit() else digits
            digits = "" if of == "backspace" else digits
            hand.key(of, of if len(of) == 1 else "")
        elif what == "line":
            lined, posed = of, posed or of.startswith("pose")
            hand.line(of)
        elif what == "ask":
            pose, moved, digits, lined, posed = ARRIVAL, 0.0, "", "", False
            hand.asked(*SUBJECTS[of])
        elif what == "jogged":
            there = Pose(pose.x_mm, pose.y_mm, pose.z_mm - of, 90.0, tool=0)
            hand.happens(WasRegarded(JogSubject(pose, there, of))) if state.at_place else None
            pose, moved = (there, moved + of) if state.at_place else (pose, moved)
            hand.reads(pose)
        elif what == "waits":
            hand.waits()
        elif what == "told":
            hand.happens(WasTold("refused"))
        elif what == "fast":
            hand.happens(TooFast())
        else:
            hand.now += of
        for text in hand.sent[before:]:
            if text == "done" and state.touch is not None and state.touch.arrival is not None:
                assert moved > 0.0
            if str(text).startswith("pose"):
                assert state.touch is not None
                assert state.touch.types
                assert len(digits) >= 4 or posed
            if text == "y" and state.writing is not None:
                number = str(state.writing.tools[0])
                assert number in digits or lined == number


HISTORIES = (st.lists(HAPPENINGS, max_size=40), st.sampled_from([0, 0, 2, 3]))


@settings(max_examples=80, deadline=None)
@given(*HISTORIES)
def test_no_order_of_keys_lines_and_readings_takes_an_unjogged_touch_or_writes_untyped(
    history, first
):
    check_history(history, first)


@pytest.mark.soak
@settings(max_examples=3000, deadline=None)
@given(*HISTORIES)
def test_no_order_of_many_does(history, first):
    check_history(history, first)


def test_the_sizes_of_steps_stay_within_what_the_runner_takes():
    hand = at_touch()
    for _ in range(9):
        hand.keys("+")
    assert hand.state.jogging.step == STEP_SIZES[-1] == 5.0
    for _ in range(9):
        hand.keys("-")
    assert hand.state.jogging.step == STEP_SIZES[0] == 0.01


def test_a_position_from_before_the_robot_moved_is_not_shown_as_that_of_now():
    hand = Sitting().reads(ARRIVAL)
    hand.now += 5.0
    hand.happens(WasRegarded(touch_subject()))
    hand.happens(WasAsked(1, "?", Question.PLACE, hand.now))
    assert hand.state.pose is None


def test_a_reading_without_a_position_changes_nothing_of_the_steps():
    hand = at_touch().happens(WasRead(Reading(11.0, "fault", halted=True)))
    assert hand.keys("5").sent == []
    assert hand.happens(KeyPressed("escape", "", 12.0)).happens(LineTyped("", 12.0)).sent == []


def test_what_nobody_had_a_screen_to_read_is_kept_for_the_end():
    going = MoveSubject(ARRIVAL, Way.JOINT, 20.0, "Lifting.")
    hand = Sitting().happens(WasTold("old")).asked(touch_subject())
    assert hand.state.fresh == ()
    for one in (WasTold("Lifting."), WasRegarded(going), WasTold("settled")):
        hand.happens(one)
    assert hand.state.fresh == ("settled",)


def test_a_question_is_not_headed_by_movements_that_had_a_screen_of_their_own():
    going = MoveSubject(ARRIVAL, Way.JOINT, 20.0, "Lifting.")
    hand = Sitting().happens(WasTold("The pin is as high as before."))
    for one in (WasTold("Lifting."), WasRegarded(going)):
        hand.happens(one)
    hand.asked(None, Question.YES_NO, "As long as the old one?")
    shown = "\n".join(screen_of(hand.state, hand.now).lines)
    assert "The pin is as high as before." in shown
    assert "Lifting." not in shown


@pytest.mark.parametrize(
    "subject",
    [
        touch_subject(surface=True),
        touch_subject(surface=True, limit_mm=0.2),
        touch_subject(number=1, limit_mm=0.2, arrival=None),
    ],
    ids=["a surface", "a surface in the proof", "the first contact after a break"],
)
def test_what_is_no_pin_is_named_by_whoever_asks_for_it(subject):
    hand = Sitting().asked(subject, text="Jog the tip onto the top of the sphere.")
    assert instruction(hand.state) == "Jog the tip onto the top of the sphere."


def test_what_is_chosen_from_is_seen_however_much_there_is_to_be_read_above():
    subject = ChoiceSubject("Recover", ("What we read: " + "one tool more. " * 12,) * 6, CHOICES)
    hand = Sitting().asked(subject, kind=Question.TEXT, text="Which needle is mounted?")
    rows = screen_of(hand.state, hand.now).rows()
    assert len(rows) == 24
    text = "\n".join(rows)
    assert all(option in text for option in CHOICES)
    assert any(row.strip() == "..." for row in rows)


def at_contradiction():
    question, offered = contradicted()
    return Sitting(in_tool=1).asked(offered, Question.CHOICE, question)


def test_enter_at_a_contradicted_turn_test_is_the_old_value_and_never_another_row():
    assert at_contradiction().key("enter").sent == ["1"]
    assert at_contradiction().line("").sent == ["1"]
    marked = at_contradiction().keys("2", "2", "2", "2")
    assert marked.key("enter").sent == []
    assert "ENTER does nothing here" in marked.state.message
    assert marked.keys("5").sent == ["5"]


@pytest.mark.parametrize("ends", ["stop", "0"])
def test_who_stops_at_a_contradicted_turn_test_gets_the_old_value(ends):
    assert at_contradiction().keys(ends).sent == ["q"]
    assert at_contradiction().line("stop").sent == ["q"]


@pytest.mark.parametrize("typed", ["N-0418", "y", "6", "0", "2 3", "\uff15x"])
def test_what_is_no_number_of_a_row_decides_nothing_about_a_contradiction(typed):
    hand = at_contradiction().line(typed)
    assert hand.sent == []
    assert hand.state.message == "Type the number of a row."
    assert hand.line("\uff12").sent == ["2"], "a wide figure is one"


def test_what_came_before_the_question_of_a_contradiction_answers_nothing():
    question, offered = contradicted()
    hand = Sitting()
    hand.happens(WasRegarded(offered))
    hand.happens(WasAsked(1, question, Question.CHOICE, 10.0))
    assert hand.line("").sent == [], "the work does not wait yet"
    hand.happens(WaitsForAnswer(1, 10.0))
    hand.now = 10.2
    assert hand.line("5").sent == []
    assert hand.key("enter").sent == []
    assert hand.key("main").sent == []
    hand.now = 10.4
    assert hand.line("2").sent == ["2"]


def test_after_a_list_a_yes_or_no_is_asked_for_itself():
    hand = at_contradiction().line("5")
    hand.asked(None, Question.YES_NO, "Keep the value?")
    assert hand.line("5").sent == ["5"]
    assert told_question(hand.state) == "Keep the value? [y or n]"
    assert screen_of(hand.state, hand.now).lines[-2:] == ("  Yes", "  No")
    assert hand.line("n").sent == ["5", "n"]
