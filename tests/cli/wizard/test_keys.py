"""A key means one thing on every screen of the wizard, as the page about it says."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli.wizard.keys import AXES
from robolink_cli.wizard.screens.screen import screen_of

from robolink.runner import Question
from tests.cli.wizard._people import ARRIVAL, Sitting, touch_subject
from tests.cli.wizard.test_screens import SCREENS

PAGE = Path(__file__).parents[3] / "docs" / "wizard.md"
# Who jogs for its own sake has nothing to go on to, so the main key stops too; that is a command
# of its own (docs/poses.md).
SESSION = {name: make for name, make in SCREENS.items() if name != "free jog"}
FIGURES = "12346789"

SAID = {
    "that way": r"[XY][+-]|Z\+ up|Z- down|U[+-]|choose",
    "go on": (
        r"Next|Take it back|Yes|Switch them on|Start moving.*|Do it|Record.*|It is there"
        r"|Show the result|Finish|Start again"
    ),
    "the safe way out": r"STOP|Stop: .*|Leave.*|Do not write|Put the old value back\.",
    "more, less": r"One more touch|Next tool|",
    "a touch again": r"Touch \d+ again|Begin at touch 1 again",
    "open what is not shown": r"The rest|Show the report|Type the pose, .*|shows the rest\.",
    "write": r"Write|or Space\.",
    "turn the arrows": r"Turn keys",
    "the other language": r"Chinese|English",
    "close a field": r"Done",
}
"""What a screen says beside a key, by what that key means. A new label belongs to one of these."""


def table_of_the_page():
    """Return what each key means by the page, by the name that a screen shows."""
    rows = re.findall(r"^\| (.+?) \| (.+?) \| .*\|$", PAGE.read_text(encoding="utf-8"), re.M)
    meant = {}
    for keys, meaning in rows:
        if meaning not in SAID:
            continue
        for key in re.findall(r"`(.)`|([A-Z][\w-]+)", keys):
            name = key[0] or key[1]
            assert name not in meant, f"{name} has two rows"
            meant[name] = meaning
    assert {*meant.values()} == {*SAID}
    return meant


def shown_on(screen):
    """Yield each key of a screen with what stands beside it, wherever it stands."""
    yield from screen.actions
    for line in (*screen.lines, screen.message):
        for key, said in re.findall(r"\[([^\]\d][^\]]*|\d)\] ?((?:[^\[ ]| (?! ))*)", line):
            yield key, said.strip()


def test_every_key_of_every_screen_means_what_the_page_says():
    meant, used = table_of_the_page(), set()
    meant["arrows"] = "that way"
    for name, make in SESSION.items():
        hand = make()
        for key, said in shown_on(screen_of(hand.state, hand.now)):
            assert key in meant, (name, key, said)
            assert re.fullmatch(SAID[meant[key]], said), (name, key, said, meant[key])
            used.add(key)
    assert {"1", "3", "5", "0", "+", "/", ".", "*", "Tab", "F2", "Enter"} <= used


@pytest.mark.parametrize("name", SESSION)
def test_a_figure_moves_the_robot_or_the_mark_and_answers_nothing(name):
    for figure in FIGURES:
        hand = SESSION[name]()
        hand.now += 1.0
        before, sent = hand.state, [*hand.sent]
        hand.keys(figure)
        new, state = hand.sent[len(sent) :], hand.state
        if before.at_place and not before.typing:
            assert new in ([f"{AXES[figure]}{before.jogging.step:g}"], []), figure
        elif before.has_field:
            assert (new, state.typed) == ([], before.typed + figure)
        else:
            assert new == []
            assert state.wants is None
            marked = before.marked if figure not in "28" else state.marked
            assert replace(before, marked=marked, message="") == replace(state, message="")


def test_at_a_place_each_figure_is_a_step():
    for figure in FIGURES:
        hand = Sitting().asked(touch_subject(arrival=ARRIVAL), Question.PLACE)
        assert hand.keys(figure).sent == [f"{AXES[figure]}0.1"]


@pytest.mark.parametrize("name", SESSION)
def test_enter_alone_gets_past_nothing_that_moves_or_writes(name):
    """It closes a field, takes a cell or a job, and puts an old value back; nothing else."""
    hand = SESSION[name]()
    hand.now += 1.0
    sent = [*hand.sent]
    for _ in range(5):
        hand.key("enter")
        hand.now += 1.0
    allowed = {"choose": ["1"], "choose job": ["1"], "turn test asks": ["1"], "text": ["N-0418"]}
    assert hand.sent[len(sent) :] == allowed.get(name, [])
