"""`robolink recover` leads through all open jobs without contradicting itself."""

import json
import re
from contextlib import contextmanager, nullcontext

import pytest
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.wizard.state import ChoiceSubject

from robolink.model import Marker, MarkerKind
from robolink.timing import local_label
from tests.faults import _recipe_instants
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._what_stands import COMMANDS, Disturbed

WHEN = "2026-01-01T00:00:00+00:00"
TURNED = re.compile(r'\$Execute,"Go XY')
WRITTEN = re.compile(r'\$Execute,"TLSet 1, XY')


@contextmanager
def cut_off(folder):
    """Open a cell whose link was cut during the turn of tool 1's turn test."""
    command = COMMANDS["EPSON: recalibrate"]
    with command.case.cell() as cell:
        assert isinstance(cell, EpsonRecipeCell)
        panel, cut = cell.simulator.panel, list[str]()

        def pull(_number: int, request: str) -> None:
            if not cut and WRITTEN.match(request):
                cut.append("written")
            elif cut == ["written"] and TURNED.match(request):
                cut.append(request)
            elif len(cut) == 2 and request == "$GetStatus":
                cut.append("gone")
                panel.cut_link()

        recipe = folder / "recipe.toml"
        recipe.write_text(command.case.recipe)
        words = [word.format(recipe=recipe, assist=cell.url) for word in command.words]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_recipe_instants.Instants, "pass_by", _passing(pull))
            ended = cell.run(*words)
        assert cut[-1] == "gone"
        cell.clock.sleep(60.0)  # the movement goes on without its client, and ends
        assert (ended.code, cell.changed()) == (6, {1}), ended.err
        yield cell


@pytest.fixture
def cell(tmp_path):
    with cut_off(tmp_path) as cell:
        yield cell


def _passing(pull):
    def pass_by(self, kind: str, what: str = "") -> None:
        if kind == "request":
            pull(0, what)

    return pass_by


def kinds(cell):
    return {marker.kind for marker in cell.open_markers()}


def poses(text):
    return re.findall(r"X [-\d.]+ Y [-\d.]+ Z [-\d.]+ U [-\d.]+ \(tool \d\)", text)


def test_what_reading_can_tell_is_settled_and_the_movement_waits_for_a_word(cell):
    assert kinds(cell) == {MarkerKind.CHANGE, MarkerKind.SELECTION, MarkerKind.MOVE}
    ended = cell.run("recover")
    assert ended.code == 6, ended.err
    assert (cell.changed(), cell.selected) == (set(), 1)
    assert cell.settings() == cell.settings_before
    assert kinds(cell) == {MarkerKind.MOVE}
    said = ended.err + ended.out
    assert "  done: Restore the old value of tool 1" in said
    (pose,) = poses(said)
    assert pose.endswith("(tool 1)"), "the cell's own tool is selected by then"
    assert "'robolink recover' again on a terminal, or with --yes" in said
    assert "resolve" not in said


def test_the_word_of_a_person_settles_the_rest_in_the_same_run(cell):
    ended = cell.run("recover", asks=True)
    assert ended.code == 0, ended.err
    assert cell.open_markers() == ()
    assert "All jobs are finished or undone; tool 1 is selected." in ended.out
    assert len(poses(ended.err)) == 1


def test_a_no_leaves_the_movement_open_and_the_rest_is_settled(cell, monkeypatch):
    monkeypatch.setattr(_recipe_instants.Person, "poll", lambda person, wait_s: "n")
    ended = cell.run("recover", asks=True)
    assert ended.code == 9, ended.err
    assert kinds(cell) == {MarkerKind.MOVE}
    assert (cell.changed(), cell.selected) == (set(), 1)


def test_yes_is_the_word_of_somebody_who_has_looked(cell):
    ended = cell.run("recover", "--yes", "--json")
    assert ended.code == 0, ended.err
    document = json.loads(ended.out)
    assert document["schema"] == "robolink/recover/1"
    assert document["left"] == []
    assert {found["kind"] for found in document["settled"]} == {"change", "selection", "move"}
    assert (document["selected_tool"], document["pose"]["tool"]) == (1, 1)
    assert cell.open_markers() == ()


def test_a_dry_run_tells_what_it_would_do_and_does_nothing(cell):
    before, sent = cell.open_markers(), len(cell.writes())
    ended = cell.run("recover", "--dry-run")
    assert ended.code == 6, ended.err
    assert "  to do: Restore the old value of tool 1" in ended.err
    assert "  to do: you decide" in ended.err
    assert cell.open_markers() == before
    assert (len(cell.writes()), cell.changed()) == (sent, {1})


def test_the_old_name_does_the_same_and_is_its_own_word_off_a_terminal(cell):
    ended = cell.run("resolve", "--json")
    assert ended.code == 0, ended.err
    document = json.loads(ended.out)
    assert document["schema"] == "robolink/resolve/1"
    assert len(document["findings"]) == 3
    assert (document["settled"], document["forgotten"]) == (True, 0)
    assert (cell.open_markers(), cell.changed(), cell.selected) == ((), set(), 1)


def test_the_old_name_is_not_listed(cell):
    listed = cell.run("--help").out
    assert "  recover " in listed
    assert "resolve" not in listed


def test_forgetting_takes_a_word_and_touches_nothing(cell):
    ended = cell.run("recover", "--forget", "--yes", "--json")
    assert ended.code == 0, ended.err
    assert json.loads(ended.out)["forgotten"] == 3
    assert cell.open_markers() == ()
    assert (cell.changed(), cell.selected) == ({1}, 1)


def test_a_write_that_took_is_told_of_with_the_change_that_takes_it_back(tmp_path):
    command = COMMANDS["EPSON: recalibrate"]
    with command.case.cell() as cell:
        whole = command.run(cell, tmp_path)
        assert whole.code == 0, whole.err
        writes = [n for n, text in enumerate(cell.requests()) if WRITTEN.match(text)]
    with command.case.cell() as cell:
        with Disturbed("DROP_REPLY", writes[-1]).on(cell):
            assert command.run(cell, tmp_path).code == 6
        assert cell.changed() == {1}
        ended = cell.run("recover")
        assert ended.code == 0, ended.err
        assert cell.changed() == set()
        assert "Tool 1 holds the new value" not in ended.err, "a moment later it does not"
        assert ended.err.count("Tool 1 holds") == 1
        assert ended.err.count("is selected") == 1, "before it is put right"


def test_what_nobody_can_read_takes_a_word_too(cell):
    log = cell.journal.log(cell.url)
    log.begin(Marker("x", MarkerKind.SET, "something newer", WHEN, {"of": "another version"}))
    log.close()
    left = cell.run("recover")
    assert left.code == 6, left.err
    assert f"The record of an unfinished job of {local_label(WHEN)} cannot be read." in left.err
    assert {marker.request for marker in cell.open_markers()} >= {"something newer"}
    assert cell.run("recover", "--yes").code == 0
    assert cell.open_markers() == ()


@pytest.mark.parametrize(
    ("word", "code", "changed", "left"),
    [("old", 0, set(), 0), ("new", 0, {1}, 0), ("blocked", 6, {1}, 3)],
)
def test_one_word_says_which_needle_is_mounted(cell, word, code, changed, left):
    ended = cell.run("recover", "--choose", word)
    assert ended.code == code, ended.err
    assert cell.changed() == changed
    assert len(cell.open_markers()) == left
    assert cell.run("recover", "--choose", word, "--yes").code == 2


class Sits:
    """A desk at which a person takes a row, or leaves."""

    def __init__(self, answer):
        self.answer, self.pages, self.asked = answer, [], []
        self.glance = lambda: None
        self.silent_s = lambda: 0.0

    def tell(self, text):
        pass

    def wait_while(self, why):
        assert not why()

    def following(self, look):
        return nullcontext()

    def look(self):
        pass

    def regard(self, subject):
        self.pages.append(subject)

    def ask(self, question, kind):
        self.asked.append(question)

    def poll(self, wait_s):
        return self.answer


@pytest.mark.parametrize(
    ("answer", "code", "changed"), [("1", 0, set()), ("2", 9, {1}), ("3", 9, {1}), ("q", 9, {1})]
)
def test_at_a_desk_the_page_shows_what_is_read_and_marks_nothing(cell, answer, code, changed):
    desk = Sits(answer)
    with sitting_at(desk):
        ended = cell.run("recover")
    assert ended.code == code, ended.err
    assert cell.changed() == changed
    # A person who wants the new value is asked before the robot moves, and "2" agrees to nothing.
    listed = ["Start moving"] if answer == "2" else []
    assert desk.asked == ["Look at the robot: which needle is mounted?", *listed]
    page = next(one for one in desk.pages if isinstance(one, ChoiceSubject))
    assert page.marked is None
    assert any("Written, but never tested." in row for row in page.above)
    assert len(page.options) == 3
    assert page.options[1] == "The new one. Make the turn test, then keep the new value."
    if listed:
        assert kinds(cell) == {MarkerKind.CHANGE}, "nothing is lost, and nothing is kept"
