"""A press does what the screen offered on which the finger went down, and nothing else."""

import itertools
from typing import Any

import pytest
from robolink_cli.wizard.happenings import (
    HasEnded,
    OffersAtTheEnd,
    Pressed,
    WasRegarded,
    WizardCommand,
)
from robolink_cli.wizard.state import CHANGE_LANGUAGE, ChoiceSubject, LastScreen
from robolink_cli.wizard.views.view import view_of

from robolink.model import Path, Pose, WorkBox
from robolink.runner import JogRange, MoveSubject, Question
from tests.cli.wizard._people import (
    ARRIVAL,
    CHECK,
    Sitting,
    fit_subject,
    touch_subject,
    write_subject,
)

LIST = ChoiceSubject("Choose", (), ("one", "two"), other="zh")


def shown(hand) -> Any:
    """Return the view; the tests reach into bodies of every kind."""
    return view_of(hand.state, hand.now)


def press(hand, action, value="", number=None):
    """Press on what is shown; return what was sent for it."""
    before = len(hand.sent)
    number = shown(hand).number if number is None else number
    hand.happens(Pressed(number, action, value, hand.now))
    return hand.sent[before:]


def at_touch(**more):
    return Sitting().asked(touch_subject(**more))


def at_list():
    return Sitting().asked(LIST, Question.TEXT)


def at_check():
    return Sitting().asked(CHECK, Question.YES_NO)


def at_fit():
    fit = fit_subject(0.01, 0.02, 0.05, worst=2)
    return Sitting().asked(fit, Question.YES_NO)


def at_values(*tools):
    return Sitting().asked(write_subject(*(tools or (3,))), Question.YES_NO)


def at_question():
    return Sitting().asked(None, Question.YES_NO, text="Is it clear?")


def at_text():
    return Sitting().asked(None, Question.TEXT, text="Which needle?")


def at_end(*, done=True, again=True, age_s=1.0):
    hand = Sitting().asked(None, Question.TEXT)
    offers = frozenset({WizardCommand.SHOW_REPORT, WizardCommand.NEXT_TOOL})
    hand.happens(WasRegarded(OffersAtTheEnd(offers)))
    ended = LastScreen(done, ("Well.",), (), hand.now - age_s, "DONE", again=again)
    return hand.happens(HasEnded(ended))


def moving():
    going = MoveSubject(Pose(300.0, 400.0, -60.0, 90.0, tool=0), Path.JOINT, 20.0, "Up.")
    return at_touch().happens(WasRegarded(going))


SCREENS = {
    "list": at_list,
    "check": at_check,
    "touch": at_touch,
    "fit": at_fit,
    "values": at_values,
    "question": at_question,
    "text": at_text,
    "end": at_end,
    "moving": moving,
    "wait": Sitting,
}

DONE = [
    (at_list, "choose", "2", ["2"]),
    (at_list, "language", "", [CHANGE_LANGUAGE]),
    (at_list, "leave", "", ["q"]),
    (at_check, "leave", "", ["n"]),
    (at_touch, "jog", "x+0.1", ["x+0.1"]),
    (at_touch, "jog", "u-5", ["u-5"]),
    (at_touch, "again", "", ["again"]),
    (at_touch, "leave", "", ["q"]),
    (at_fit, "go_on", "", ["n"]),
    (at_fit, "again", "", ["y"]),
    (at_values, "write", "3", ["y"]),
    (at_values, "write", "\uff13", ["y"]),
    (lambda: at_values(1, 12), "write", "1, 12", ["y"]),
    (at_values, "reject", "", ["n"]),
    (at_question, "yes", "", ["y"]),
    (at_question, "no", "", ["n"]),
    (at_text, "answer", " N-0418 ", ["N-0418"]),
    (at_text, "leave", "", ["q"]),
    (at_end, "finish", "", [WizardCommand.LEAVE]),
    (at_end, "report", "", [WizardCommand.SHOW_REPORT]),
    (at_end, "next", "", [WizardCommand.NEXT_TOOL]),
    (moving, "leave", "", [WizardCommand.END_WORK]),
    (Sitting, "leave", "", [WizardCommand.END_WORK]),
]


@pytest.mark.parametrize(("screen", "action", "value", "sent"), DONE)
def test_what_a_screen_offers_is_done(screen, action, value, sent):
    hand = screen()
    assert press(hand, action, value) == sent


ACTIONS = sorted(
    {
        *(action for _, action, _, _ in DONE),
        *("take", "size", "turn", "pose", "more", "confirm", "start", "begin_again", "go", ""),
    }
)
VALUES = ["", "1", "2", "3", "mounted", "x+0.1", "y-5", "0.1", "n", "y", "q", "done", "motors"]


@pytest.mark.parametrize("screen", SCREENS)
@pytest.mark.parametrize("number", [-1, 1, 999])
def test_a_press_for_another_screen_does_nothing_and_says_so(screen, number):
    hand = SCREENS[screen]()
    before, other = hand.state, shown(hand).number + number
    for action, value in itertools.product(ACTIONS, VALUES):
        assert press(hand, action, value, other) == [], (action, value)
        assert hand.state.message
        hand.state = hand.state.says(before.message)
        assert hand.state == before


@pytest.mark.parametrize("screen", SCREENS)
def test_what_a_screen_does_not_offer_does_nothing_and_says_so(screen):
    hand = SCREENS[screen]()
    before, view = hand.state, shown(hand)
    offered = {one.name for one in view.actions} | {"choose", "confirm", "jog", "size", "turn"}
    for action, value in itertools.product(set(ACTIONS) - offered, VALUES):
        assert press(hand, action, value) == []
        assert hand.state.message
        hand.state = before


@pytest.mark.parametrize(
    ("screen", "action", "value"),
    [
        (at_list, "choose", "3"),
        (at_list, "choose", "0"),
        (at_list, "choose", "1 "),
        (at_list, "choose", ""),
        (at_list, "choose", CHANGE_LANGUAGE),
        (at_list, "language", "en"),
        (at_check, "confirm", ""),
        (at_check, "confirm", "guard"),
        (at_check, "start", ""),
        (at_touch, "jog", "x+0.2"),
        (at_touch, "jog", "x+50"),
        (at_touch, "jog", "x+0.1 y+0.1"),
        (at_touch, "jog", "v+0.1"),
        (at_touch, "jog", "x+1e0"),
        (at_touch, "jog", "x+\u0665"),
        (at_touch, "jog", "done"),
        (at_touch, "jog", ""),
        (at_touch, "size", "2"),
        (at_touch, "size", "1e-2"),
        (at_touch, "size", "nan"),
        (at_touch, "turn", "x"),
        (at_touch, "again", "x"),
        (at_touch, "again", "1 2"),
        (at_touch, "pose", "1 2 3 4"),
        (at_touch, "take", "done"),
        (at_fit, "more", ""),
        (at_values, "write", ""),
        (at_values, "write", "1"),
        (at_values, "write", "33"),
        (at_values, "write", "y"),
        (lambda: at_values(1, 12), "write", "1"),
        (at_values, "again", ""),
        (at_values, "leave", ""),
        (at_question, "yes", "y"),
        (at_question, "answer", "y"),
        (at_text, "answer", ""),
        (at_text, "answer", "a\nb"),
        (at_text, "answer", "\x1b[2J"),
        (at_text, "answer", "x" * 121),
        (at_text, "yes", ""),
        (at_end, "leave", ""),
        (at_end, "begin_again", ""),
        (lambda: at_end(done=False, again=False), "begin_again", ""),
        (lambda: at_end(done=False), "report", ""),
    ],
)
def test_a_value_that_was_not_offered_does_nothing_and_says_so(screen, action, value):
    hand = screen()
    assert press(hand, action, value) == []
    assert hand.state.message


@pytest.mark.parametrize("screen", [name for name in SCREENS if name not in ("moving", "wait")])
def test_a_press_just_after_a_screen_has_appeared_does_nothing(screen):
    """All but the way out, which is never refused."""
    for _, action, value, _ in DONE:
        if action == "leave":
            continue
        hand = at_end(age_s=0.29) if screen == "end" else SCREENS[screen]()
        if screen != "end":
            hand.now -= 0.71
        assert press(hand, action, value) == [], action


def test_a_second_press_on_the_same_question_does_nothing():
    hand = at_question()
    number = shown(hand).number
    assert press(hand, "yes") == ["y"]
    assert press(hand, "yes", number=number) == []
    assert press(hand, "no", number=number) == []
    assert hand.state.message


def test_two_taps_while_the_robot_moves_are_one_step():
    hand = at_touch()
    assert press(hand, "jog", "z-0.1") == ["z-0.1"]
    assert press(hand, "jog", "z-0.1") == []
    assert "still moving" in hand.state.message
    hand.waits()
    assert press(hand, "jog", "z-0.1") == ["z-0.1"]


def test_a_list_is_confirmed_row_by_row_and_then_started():
    hand = at_check()
    assert press(hand, "start") == []
    assert "2" in hand.state.message or "3" in hand.state.message
    for name in ("mounted", "clear"):
        assert press(hand, "confirm", name) == []
    assert press(hand, "confirm", "motors") == ["motors"]
    hand.waits()
    rows = {row.name: row for row in shown(hand).body.rows if row.name}
    assert rows["mounted"].confirmed
    assert rows["clear"].confirmed
    assert press(hand, "confirm", "clear") == []
    assert press(hand, "start") == []


def test_a_touch_is_taken_once_the_tip_was_jogged_by_a_fine_step():
    hand = at_touch()
    assert press(hand, "take") == []
    assert "Jog it onto the pin" in hand.state.message
    assert press(hand, "size", "0.5") == []
    assert shown(hand).body.pad.size == 0.5
    before = [one.axis for one in shown(hand).body.pad.arrows]
    assert press(hand, "turn") == []
    after = [one.axis for one in shown(hand).body.pad.arrows]
    assert before[:4] == ["x+", "y+", "x-", "y-"]
    assert after[:4] == ["y+", "x-", "y-", "x+"]
    assert after[4:] == before[4:]


def test_a_typed_pose_is_kept_and_taken_after_it():
    hand = at_touch(types=True)
    assert press(hand, "pose", "1 2 3") == []
    assert not hand.state.pose_typed
    assert press(hand, "pose", "1 2 3 4") == []
    assert shown(hand).body.typed == "1 2 3 4"
    assert press(hand, "take") == ["pose 1 2 3 4"]


def test_an_earlier_touch_is_made_again_by_its_number():
    hand = at_touch(number=3, retakes=True)
    assert press(hand, "again", "7") == []
    assert press(hand, "again", "1") == ["again 1"]
    assert press(at_touch(number=3, retakes=True), "again") == ["again 2"]


def test_a_free_jog_has_no_touch_and_ends_by_the_way_out():
    box = WorkBox.around(ARRIVAL, xy_mm=5.0, below_mm=5.0, above_mm=5.0)
    hand = Sitting().asked(JogRange(ARRIVAL, box))
    assert [one.name for one in shown(hand).actions] == ["leave"]
    assert press(hand, "take") == []
    assert press(hand, "jog", "z+1") == ["z+1"]
    hand.waits()
    assert press(hand, "leave") == ["done"]


def test_the_last_screen_has_a_number_of_its_own_and_the_next_job_goes_on_counting():
    hand = at_question()
    question = shown(hand).number
    hand.happens(HasEnded(LastScreen(False, (), (), hand.now - 1.0, "STOPPED")))
    assert shown(hand).number == question + 1
    assert press(hand, "begin_again", number=question) == []
    assert press(hand, "begin_again") == [WizardCommand.BEGIN_AGAIN]


def test_only_the_way_out_can_be_pressed_while_an_answer_is_carried_out():
    hand = at_fit()
    press(hand, "go_on")
    free = [one.name for one in shown(hand).actions if not one.why_not]
    assert free == ["leave"]
    assert press(hand, "again") == []
    assert press(hand, "leave") == [WizardCommand.END_WORK]
