"""A key has one meaning on every screen of the wizard; the language key."""

import os
import re
import time
from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from prompt_toolkit.data_structures import Size
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.output.vt100 import Vt100_Output
from robolink_cli.commands.measure.recipe_choice import choose_cell, choose_recipe
from robolink_cli.console.language import language_now, speaking_for
from robolink_cli.wizard.faces.full import FullFace
from robolink_cli.wizard.happenings import LineTyped, WasRegarded, WasTold
from robolink_cli.wizard.keys import AXES
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.state import CHANGE_LANGUAGE, ChoiceSubject, Header
from robolink_cli.wizard.work import Desk

from robolink.messages import tr
from robolink.runner import Question
from tests.cli.wizard._people import ARRIVAL, CHECK, Sitting, touch_subject, write_subject
from tests.cli.wizard._screen import ScreenHand
from tests.cli.wizard.test_screens import SCREENS
from tests.contract._terminal import Terminal

# A key has one meaning on every screen of the wizard, as its page says.

PAGE = Path(__file__).parents[3] / "docs" / "wizard.md"
# A jog for its own sake has no next step, so the main key stops too; that is a command of its own
# (docs/reference/jogging.md 2).
SESSION = {name: make for name, make in SCREENS.items() if name != "free jog"}
FIGURES = "12346789"

SAID = {
    "that way": r"[XY][+-]|Z\+ up|Z- down|U[+-]|choose",
    "go on": (
        r"Next|Take it back|Yes|Switch them on|Start moving.*|Do it|Record.*|It is there"
        r"|Show the result|Finish|Start again"
    ),
    "the safe way out": r"STOP|Stop: .*|Leave.*|Do not write|Restore the old value\.",
    "more, less": r"One more touch|Next tool|",
    "a touch again": r"Touch \d+ again|Start again at touch 1",
    "open what is not shown": r"The rest|Show the report|Type the pose, .*|shows the rest\.",
    "write": r"Write|or Space\.",
    "turn the arrows": r"Turn keys",
    "the other language": r"Chinese|English",
    "close a field": r"Done",
}
"""The labels beside a key, by the key's meaning. A new label belongs to one of these."""


def table_of_the_page():
    """Return the meaning of each key on the page, by the name that a screen shows."""
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
    """Yield each key of a screen with its label, wherever it is."""
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
    """It closes a field, accepts a cell or a job, and restores an old value; nothing else."""
    hand = SESSION[name]()
    hand.now += 1.0
    sent = [*hand.sent]
    for _ in range(5):
        hand.key("enter")
        hand.now += 1.0
    allowed = {"choose": ["1"], "choose job": ["1"], "turn test asks": ["1"], "text": ["N-0418"]}
    assert hand.sent[len(sent) :] == allowed.get(name, [])


# The language can be changed while choosing cell or job; later texts are in that language.

RECIPES = Path(__file__).parents[3] / "examples" / "recipes"
CELLS = '[cells.a]\nurl = "epson+tcp://127.0.0.1:1"\n[cells.b]\nurl = "epson+tcp://127.0.0.1:2"\n'


class Answering(Desk):
    """Answers as instructed."""

    def __init__(self, *answers):
        super().__init__()
        self.left = list(answers)

    def poll(self, wait_s):
        return self.left.pop(0)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("LANG", "LC_ALL", "LC_MESSAGES", "LANGUAGE", "ROBOLINK_LANG"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    (tmp_path / "robolink.toml").write_text(CELLS)
    text = (RECIPES / "needle-one-touch.toml").read_text(encoding="utf-8")
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    (tmp_path / "b.toml").write_text('schema = "robolink/recipe/1"\n', encoding="utf-8")
    return tmp_path


def head():
    return Header("line3", tr("Change needle"))


def shown(desk):
    """Return headers, lists and messages."""
    happened = desk.happened()
    about = [one.subject for one in happened if isinstance(one, WasRegarded)]
    return (
        [one.job for one in about if isinstance(one, Header)],
        [one for one in about if isinstance(one, ChoiceSubject)],
        [one.text for one in happened if isinstance(one, WasTold)],
    )


def test_all_of_a_list_is_made_anew_in_the_other_language_and_so_is_what_follows(here):
    with speaking_for(["change"]):
        desk = Answering(CHANGE_LANGUAGE, "2")
        assert choose_cell(desk, head).name == "b"
        jobs, lists, _ = shown(desk)
        assert [one.other for one in lists] == ["zh", "en"]
        assert [one.step for one in lists] == ["Choose", "选择"]
        assert jobs == ["Change needle", "更换胶针"]
        assert (language_now(), os.environ["LANGUAGE"]) == ("zh", "zh_CN")
        desk = Answering(CHANGE_LANGUAGE, CHANGE_LANGUAGE, "1")
        assert choose_recipe(desk, None, head=head).path.name == "a.toml"
        jobs, lists, told = shown(desk)
        assert [one.other for one in lists] == ["en", "zh", "en"]
        assert jobs == ["更换胶针", "Change needle", "更换胶针"]
        assert lists[1].details[0][0].startswith("Touch a known pin once")
        assert lists[0].details == lists[2].details != lists[1].details
        # The message about the wrong recipe is repeated: its screen is drawn anew.
        assert [name for text in told for name in re.findall(r"\w\.toml(?=:)", text)] == [
            "b.toml"
        ] * 3
        assert tr("Next") == "下一步"
    assert tr("Next") == "Next"
    assert "LANGUAGE" not in os.environ


def test_a_console_that_cannot_show_it_offers_no_other_language(here, monkeypatch):
    class Poor(StringIO):
        encoding = "ascii"

    monkeypatch.setattr("sys.stderr", Poor())
    with speaking_for(["change"]):
        desk = Answering("1")
        choose_cell(desk, head)
    assert [one.other for one in shown(desk)[1]] == [""]


JOBS = ChoiceSubject("Choose", (), ("a", "b"), other="zh")


def test_the_key_answers_only_where_it_is_offered():
    assert Sitting().asked(JOBS, Question.TEXT).keys("f2").sent == [CHANGE_LANGUAGE]
    for subject, kind in (
        (ChoiceSubject("Recover", (), ("a",), enters=False), Question.TEXT),
        (touch_subject(), Question.PLACE),
        (write_subject(1), Question.YES_NO),
        (CHECK, Question.YES_NO),
        (None, Question.TEXT),
    ):
        assert Sitting().asked(subject, kind).keys("f2").sent == [], subject


@pytest.mark.parametrize(
    ("line", "sent"),
    [
        ("中文", [CHANGE_LANGUAGE]),
        ("\uff23hinese", [CHANGE_LANGUAGE]),
        ("english", []),
        ("2", ["2"]),
    ],
)
def test_a_typed_word_changes_it_too(line, sent):
    hand = Sitting().asked(JOBS, Question.TEXT)
    assert hand.happens(LineTyped(line, hand.now)).sent == sent
    plain = Sitting().asked(ChoiceSubject("Recover", (), ("a", "b")), Question.TEXT)
    assert plain.happens(LineTyped(line, plain.now)).sent == [one for one in sent if one == "2"]


@pytest.mark.parametrize("sent", ["\x1bOQ", "\x1b[12~", "\x1b[[B"], ids=repr)
def test_each_kind_of_terminal_sends_it_in_its_own_way(sent):
    desk, hand = Desk(), Sitting().asked(JOBS, Question.TEXT)
    came: list[KeyPress] = []
    Vt100Parser(came.append).feed_and_flush(sent)
    with create_pipe_input() as source:
        face = FullFace(source, Vt100_Output(StringIO(), lambda: Size(24, 80), term="xterm"))
        face._desk, face._state = desk, hand.state
        for press in came:
            face._press(str(getattr(press.key, "value", press.key)), press)
        for one in face._gate.due(time.monotonic() + 1.0):
            face._happens(face._pressed(one))
    assert not face._state.waits
    assert desk._answers.get(timeout=0.0).text == CHANGE_LANGUAGE


@pytest.mark.soak
def test_f2_on_the_whole_screen(here):
    hand = ScreenHand(["change"])
    try:
        hand.see(r"Which cell\?")
        hand.see(r"\[F2\] Chinese")
        hand.see("1 of 7  Choose")
        hand.rest(0.4)
        hand.press(["\x1bOQ"])
        hand.see("哪 *个 *工 *作 *站")
        hand.see(r"\[F2\] English")
        hand.see("1/7  选")
        hand.rest(0.4)
        hand.press(["5"])
        hand.see("做 *什 *么")
        hand.rest(0.4)
        hand.press(["\x1bOQ"])
        hand.see(r"Which job\?")
        hand.rest(0.4)
        hand.press(["0"])
        assert hand.end() == 9
    finally:
        hand.close()


@pytest.mark.soak
def test_a_word_in_the_dialogue_of_lines(here):
    terminal = Terminal("change", "--plain", controlling=True)
    try:
        terminal.wait_for(r"or chinese to read Chinese")
        time.sleep(0.4)
        terminal.press("中文\n".encode())
        terminal.wait_for("哪个工作站")
        time.sleep(0.4)
        terminal.press(b"1\n")
        terminal.wait_for("做什么")
        time.sleep(0.4)
        terminal.press("停止\n".encode())
        assert terminal.end() == 9
        assert "您没有选择就离开了" in terminal.shown
    finally:
        terminal.close()
