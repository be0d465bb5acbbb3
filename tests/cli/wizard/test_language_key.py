"""Whoever chooses cell or job changes the language there; what comes after is in that language."""

import os
import re
import time
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
from robolink_cli.wizard.state import CHANGE_LANGUAGE, ChoiceSubject, Header
from robolink_cli.wizard.work import Desk

from robolink.messages import tr
from robolink.runner import Question
from tests.cli.wizard._people import CHECK, Sitting, touch_subject, write_subject
from tests.cli.wizard._screen import ScreenHand
from tests.contract._terminal import Terminal

RECIPES = Path(__file__).parents[3] / "examples" / "recipes"
CELLS = '[cells.a]\nurl = "epson+tcp://127.0.0.1:1"\n[cells.b]\nurl = "epson+tcp://127.0.0.1:2"\n'


class Answering(Desk):
    """Answers what it was told to."""

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
    """Return headers, lists and what was told."""
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
        # What was said of the recipe that is wrong is said again: its screen is drawn anew.
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
