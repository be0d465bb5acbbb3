"""A new value that a person chose after a crash is kept once its turn test has passed."""

import re
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import pytest
from robolink_cli.prompts import operator as _operator
from robolink_cli.prompts.current_desk import sitting_at
from robolink_simulators.control.assist import open_eyes

from robolink.model import EntryKind, MarkerKind
from tests.faults import _recipe_instants
from tests.faults._kills import kill
from tests.faults._recipe_instants import EVERYTHING, Instants
from tests.faults._what_stands import COMMANDS, Disturbed
from tests.faults.test_recover_guides import cell, cut_off, kinds

__all__ = ["cell"]

EVERY_ANSWER = 33  # of about 396 of the controller in a whole turn test
MOVED = re.compile(r'\$Execute,"(Go|Move) ')


@contextmanager
def somebody(cell, answers=None):
    """Put a person who jogs at the terminal; yields the questions.

    Args:
        cell: The cell.
        answers: Replacements for the answers, by the question's number.
    """
    asked = []

    class Somebody(_operator.AssistedOperator):
        def ask(self, question, kind):
            asked.append(question)
            super().ask(question, kind)

        def poll(self, wait_s):
            said = (answers or {}).get(len(asked))
            return said or super().poll(wait_s)

    with open_eyes(cell.url) as eyes, pytest.MonkeyPatch.context() as patch:

        def person(instants):
            return Somebody.with_eyes(eyes, lambda _text: None, clock=cell.clock)

        patch.setattr(_recipe_instants, "Person", person)
        yield asked


def new_chosen(cell, *more, answers=None, instants=None):
    with somebody(cell, answers) as asked:
        ended = cell.run("recover", "--choose", "new", *more, instants=instants, asks=True)
    return ended, asked


class Desk(_operator.AssistedOperator):
    """A desk at which a person takes the new value, agrees to all points, and jogs."""

    asked: tuple[str, ...] = ()

    glance: Callable[[], Any] = staticmethod(lambda: None)
    silent_s: Callable[[], float] = staticmethod(lambda: 0.0)

    def look(self):
        pass

    def regard(self, subject):
        pass

    def wait_while(self, why):
        assert not why()

    @contextmanager
    def following(self, look):
        yield

    def ask(self, question, kind):
        self.asked += (question,)
        super().ask(question, kind)

    def poll(self, wait_s):
        assert self._clock is not None
        self._clock.sleep(0.5)  # a person looks before they answer
        return "2" if len(self.asked) == 1 else super().poll(wait_s)


def killed_at(folder, dies, check):
    """Let the turn test's program die at instants of a whole run, and check the leftovers."""
    whole = Instants()
    with left_open(folder) as cell:
        new_chosen(cell, instants=whole)
    dies_at = dies(whole.passed)
    assert dies_at
    for at in dies_at:
        with left_open(folder) as cell:
            kill(lambda life: new_chosen(cell, instants=life), at, partial(check, cell))


@contextmanager
def left_open(folder):
    with cut_off(folder) as cell:
        assert cell.run("recover", "--dry-run").code == 6
        yield cell


def verified(cell):
    """Return, for each recorded turn test, whether it passed."""
    log = cell.journal.log(cell.url)
    return [entry.details["passed"] for entry in log.recorded(kinds=(EntryKind.VERIFY,))]


def moves_asked(passed):
    return sum(bool(MOVED.match(one.what)) for one in passed if one.kind == "request")


def coming_down(passed):
    """Return the middle of the robot's first own descent to the pin, if it has come."""
    downs = [one for one in passed if one.kind == "request" and "Move XY" in one.what]
    after = passed[passed.index(downs[4]) :] if downs[4:] else []
    return [one for one in after if one.kind == "wait"][:1]


def test_killed_in_the_turn_test_nothing_is_lost_and_the_next_one_keeps_the_value(tmp_path):
    def check(cell):
        new = cell.tools()[1]
        cell.come_to_rest()
        assert MarkerKind.CHANGE in kinds(cell)
        assert verified(cell) == []
        written = len(cell.writes())
        # Nobody is there: everything stays as it was, and nothing moves.
        asked = cell.moves_asked()
        assert cell.run("recover", "--dry-run").code == 6
        assert cell.moves_asked() == asked
        ended, questions = new_chosen(cell)
        assert ended.code == 0, ended.err
        assert "will move by itself to test tool 1" in questions[0]
        assert questions[1] == "Jog the tip onto the pin."
        assert len(questions) == 4
        assert (cell.tools()[1], len(cell.writes()) - written) == (new, 0)
        assert (cell.open_markers(), cell.selected, verified(cell)) == ((), 1, [True])
        assert cell.settings() == cell.settings_before

    killed_at(tmp_path, coming_down, check)


def test_a_tip_that_is_elsewhere_gets_the_old_value_back_with_one_write(cell):
    tip = cell.simulator.world.tips[1]
    cell.simulator.world.tips[1] = replace(tip, x_mm=tip.x_mm + 0.6)
    written = len(cell.writes())
    ended, questions = new_chosen(cell)
    assert ended.code == 8, ended.err
    assert "The old value of tool 1 is back." in ended.err
    assert len(questions) > 2
    assert (cell.changed(), cell.open_markers()) == (set(), ())
    assert (len(cell.writes()) - written, cell.selected, verified(cell)) == (1, 1, [False])


def test_at_a_desk_the_page_the_check_list_and_the_touches_follow_each_other(cell):
    with open_eyes(cell.url) as eyes:
        desk = Desk.with_eyes(eyes, lambda _text: None, clock=cell.clock)
        assert isinstance(desk, Desk)
        with sitting_at(desk), pytest.MonkeyPatch.context() as patch:
            patch.setattr(_recipe_instants, "Person", lambda _instants: desk)
            ended = cell.run("recover")
    assert ended.code == 0, ended.err
    assert desk.asked[:2] == ("Look at the robot: which needle is mounted?", "Start moving")
    assert len(desk.asked) == 5
    assert (cell.changed(), cell.open_markers(), verified(cell)) == ({1}, (), [True])


@pytest.mark.soak
def test_a_first_touch_far_from_the_pin_of_the_measurement_ends_it_before_anything_turns(cell):
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    cell.simulator.world.pin_mm = (x_mm + 4.0, y_mm, z_mm)
    instants = Instants()
    ended, questions = new_chosen(cell, instants=instants)
    assert ended.code == 8, ended.err
    assert len(questions) == 2
    assert not [one for one in instants.passed if one.what.startswith('$Execute,"Go ')]
    assert (cell.changed(), cell.open_markers()) == (set(), ())


@pytest.mark.soak
def test_who_does_not_agree_moves_nothing_and_leaves_it_open(cell):
    instants = Instants()
    ended, _ = new_chosen(cell, answers={1: "n"}, instants=instants)
    assert ended.code == 9, ended.err
    assert moves_asked(instants.passed) == 0
    assert (cell.changed(), kinds(cell)) == ({1}, {MarkerKind.CHANGE})
    assert cell.run("jog", "z+0.5", "--yes").code == 6, "the robot stays blocked"


@pytest.mark.soak
def test_who_stops_in_the_middle_gets_the_old_value_back(cell):
    ended, _ = new_chosen(cell, answers={3: "q"})
    assert ended.code == 9, ended.err
    assert (cell.changed(), cell.open_markers(), cell.selected) == (set(), (), 1)


@pytest.mark.soak
@pytest.mark.parametrize("how", ["e-stop", "guard", "Ctrl-C"])
def test_what_stops_the_robot_in_the_test_leaves_no_unproved_value_in_use(cell, how):
    pressed: list[int] = []

    class Presses(Instants):
        def pass_by(self, kind, what=""):
            super().pass_by(kind, what)
            if not pressed and coming_down(self.passed):
                pressed.append(moves_asked(self.passed))
                cell.disturb(how)

    instants = Presses()
    ended, _ = new_chosen(cell, instants=instants)
    assert pressed
    assert ended.code in (6, 130), ended.err
    assert moves_asked(instants.passed) == pressed[0], "nothing moves after it"
    if cell.changed():
        assert MarkerKind.CHANGE in kinds(cell), "it is blocked"
    cell.clock.sleep(5.0)
    if how != "Ctrl-C":
        cell.make_ready(how)
    assert cell.run("recover", "--choose", "old").code == 0
    assert (cell.changed(), cell.open_markers(), cell.selected) == (set(), (), 1)


@pytest.mark.soak
def test_killed_anywhere_in_it_the_change_is_open_or_proved(tmp_path):
    def check(cell):
        cell.come_to_rest()
        assert cell.changed() == {1}
        if MarkerKind.CHANGE not in kinds(cell):
            assert verified(cell) == [True]
            return
        written = len(cell.writes())
        ended, _ = new_chosen(cell)
        assert ended.code == 0, ended.err
        assert (cell.changed(), cell.open_markers(), verified(cell)[-1]) == ({1}, (), True)
        assert len(cell.writes()) == written

    def dies(passed):
        every = 1 if EVERYTHING else EVERY_ANSWER
        answers = [at for at in passed if at.kind == "answer" and at.number % every == 2 % every]
        return answers + [at for at in passed if at.kind == "commit"]

    killed_at(tmp_path, dies, check)


def test_off_a_terminal_the_new_value_is_kept_on_a_word_and_nothing_moves(cell):
    asked = cell.moves_asked()
    assert cell.run("recover", "--choose", "new").code == 0
    assert (cell.changed(), cell.open_markers(), verified(cell)) == ({1}, (), [])
    assert cell.moves_asked() == asked


@pytest.mark.soak
def test_a_group_of_axes_is_tested_too(tmp_path):
    command = COMMANDS["PLC: recalibrate"]
    with command.case.cell() as cell:
        assert command.run(cell, tmp_path).code == 0
        exchanges = len(cell.requests())
    with command.case.cell() as cell:
        with Disturbed("DISCONNECT", int(exchanges * 0.9)).on(cell):
            assert command.run(cell, tmp_path).code == 6
        cell.clock.sleep(60.0)
        assert MarkerKind.CHANGE in kinds(cell)
        written = len(cell.writes())
        ended, _ = new_chosen(cell)
        assert ended.code == 0, ended.err
        assert (cell.changed(), cell.open_markers(), verified(cell)) == ({1}, (), [True])
        assert len(cell.writes()) == written


@pytest.mark.parametrize(
    ("said", "tests", "told"),
    [
        ({}, 1, "The old value of tool 1 is back."),
        ({5: "3"}, 1, "Start again and measure the tip anew."),
        pytest.param({5: "2"}, 2, "made 2 times", marks=pytest.mark.soak),
    ],
    ids=["ENTER", "mount", "once more"],
)
def test_a_contradiction_after_a_break_is_asked_about_at_the_terminal(cell, said, tests, told):
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    cell.simulator.world.pin_mm = (x_mm + 0.15, y_mm, z_mm)
    written = len(cell.writes())
    ended, questions = new_chosen(cell, answers=said)
    assert "1 Restore the old value." in questions[4]
    assert "Keep the value" not in questions[4], "a wider one is over the limit of the recipe"
    assert (ended.code, told in ended.err) == (8, True), ended.err
    assert (cell.changed(), cell.open_markers()) == (set(), ())
    assert (verified(cell), len(cell.writes()) - written) == ([False] * tests, 1)
