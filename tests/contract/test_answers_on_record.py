"""The journal holds every answer behind a written value, in each interface, and how it came."""

from contextlib import contextmanager, nullcontext
from typing import Any

import pytest
from robolink_cli.prompts import operator as _operator
from robolink_cli.prompts import questions
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.views.journal import said_in
from robolink_simulators.control.assist import open_eyes

from robolink.model import AnsweredBy, EntryKind
from robolink.report import reports_of

pytestmark = pytest.mark.simulator_only

LENGTH = "Is the new tip exactly as long as the old one?"
WRITE = "Write these values to tool 1?"
MOUNTED = "The new nozzle is mounted and tight"
MOVES = "will move by itself"
HEIGHT = "Z of the new tip of tool 1"
FOLLOWS = "instead of keeping"
CLEAN = "Is the pin clean?"
LOT = "Which lot of glue?"

RECIPE = """
schema = "robolink/recipe/1"
name = "pin"
basis = "absolute"
z = "{z}"
verify = false

[source]
kind = "two-pose"

[station]
id = "PIN-07"

[[tools]]
number = 1

[speeds]
mm_s = 100

[[prompts]]
at = "before_measure"
text = "Is the pin clean?"

[[prompts]]
at = "start"
text = "Which lot of glue?"
answer = "text"
"""


class Person(_operator.AssistedOperator):
    """A person who jogs by what they see, confirms everything, and types a lot."""

    answers_as = AnsweredBy.PERSON
    glance = staticmethod(lambda: None)

    def look(self):
        pass

    def regard(self, subject):
        """Draw nothing."""

    @contextmanager
    def following(self, look):
        yield

    def ask(self, question, kind):
        self.question = question
        super().ask(question, kind)

    def poll(self, wait_s):
        assert self._clock is not None
        self._clock.sleep(0.5)  # an immediate answer was given without reading
        said = super().poll(wait_s)
        return "-20" if self.question.startswith(HEIGHT) else said


@contextmanager
def somebody_at(face, arm, monkeypatch):
    """Put a person at the wizard or at line input."""
    with open_eyes(arm.cell.url) as eyes:
        person: Any = Person.with_eyes(eyes, lambda _text: None, clock=arm.clock)
        monkeypatch.setattr("robolink_cli.prompts.operator._plain_terminal", lambda: person)
        for place in (
            "stopping.notes",
            "prompts.questions",
            "session.motion_consent",
            "commands.measure.recalibration",
            "commands.record.undo",
        ):
            monkeypatch.setattr(f"robolink_cli.{place}.person_here", lambda: True)
        with sitting_at(person) if face == "wizard" else nullcontext():
            yield


def recipe(folder, z="kept"):
    path = folder / "recipe.toml"
    path.write_text(RECIPE.format(z=z))
    return str(path)


def answers(arm):
    """Return the recorded answers of the newest change: question, purpose and how it came."""
    change = arm.recorded(EntryKind.CALIBRATION)[0].change
    assert change
    return {
        str(entry.details["question"]): (entry.details["answer"], entry.details["answered_by"])
        for entry in arm.recorded(EntryKind.DECISION)
        if entry.change == change and "question" in entry.details
    }


def answer_to(question, found):
    (said,) = [said for asked, said in found.items() if question in asked]
    return said


@pytest.mark.parametrize(
    ("face", "before"), [("lines", (MOVES,)), ("wizard", (MOUNTED, "Nobody in the cell"))]
)
def test_what_a_person_answers_is_on_record_under_the_change(
    arm, tmp_path, monkeypatch, face, before
):
    with somebody_at(face, arm, monkeypatch):
        done = arm.run("recalibrate", recipe(tmp_path))
    assert done.code == 0, done.err
    found = answers(arm)
    for question in (LENGTH, WRITE, CLEAN, *before):
        assert answer_to(question, found) == ("yes", "person"), question
    assert answer_to(LOT, found)[1] == "person"
    # The journal's table and the report of the change show question and answer.
    change = arm.recorded(EntryKind.CALIBRATION)[0].change
    entries = [entry for entry in reversed(arm.recorded()) if entry.change == change]
    assert any(said_in(entry).endswith(f"{LENGTH} accepted") for entry in entries)
    made = {"made_at": "2026-11-28T08:00:00Z", "robolink_version": "0.4", "check": "whole"}
    (report,) = reports_of(entries, **made)
    told = [judgement.found for judgement in report.judgements]
    assert any(one.endswith(f"{LENGTH} accepted (asked and answered)") for one in told)


def test_a_height_that_a_person_types_is_on_record(arm, tmp_path, monkeypatch):
    with somebody_at("lines", arm, monkeypatch):
        done = arm.run("recalibrate", recipe(tmp_path, "typed"))
    assert done.code == 0, done.err
    assert answer_to(HEIGHT, answers(arm)) == ("-20", "person")


def test_what_yes_and_options_answer_is_on_record_as_that(arm, tmp_path):
    assist = ("--assist", arm.cell.url, "--yes", "--json", "--answer", "2=L-7")
    done = arm.run("recalibrate", recipe(tmp_path), *assist)
    assert done.code == 0, done.err
    found = answers(arm)
    for question in (LENGTH, WRITE, CLEAN, MOVES):
        assert answer_to(question, found) == ("yes", "--yes"), question
    assert answer_to(LOT, found) == ("L-7", "option")
    done = arm.run("recalibrate", recipe(tmp_path, "typed"), *assist, "--z", "1=-20.5")
    assert done.code == 0, done.err
    assert answer_to(HEIGHT, answers(arm)) == ("-20.5", "option")


def test_a_stand_in_is_no_person(arm, tmp_path, monkeypatch):
    monkeypatch.setattr(questions, "person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
    monkeypatch.setattr("robolink_cli.stopping.notes.person_here", lambda: True)
    monkeypatch.setattr(questions, "asked", lambda _question: True)
    done = arm.run("recalibrate", recipe(tmp_path), "--assist", arm.cell.url, "--answer", "2=L-7")
    assert done.code == 0, done.err
    assert answer_to(LENGTH, answers(arm)) == ("yes", "stand-in")


@pytest.mark.parametrize("way", ["option", "recipe"])
def test_how_it_was_decided_that_z_follows_a_length_is_on_record(arm, tmp_path, way):
    first = ("n-angle", "--count", "3", "--station", "PIN-07", "--no-verify")
    assert arm.calibrate(*first).code == 0
    arm.lengthen(0.6)
    if way == "option":
        done = arm.calibrate(*first, "--if-length-changed", "difference")
    else:
        path = tmp_path / "recipe.toml"
        kind = 'kind = "n-angle"\ncount = 3\nif_length_changed = "difference"'
        path.write_text(RECIPE.format(z="kept").replace('kind = "two-pose"', kind))
        more = ("--assist", arm.cell.url, "--yes", "--json", "--answer", "2=L")
        done = arm.run("recalibrate", str(path), *more)
    assert done.code == 0, done.err
    assert answer_to(FOLLOWS, answers(arm)) == ("difference", way)


@pytest.mark.parametrize(
    ("words", "face", "how"),
    [((), "lines", "person"), ((), "", "command"), (("--json",), "lines", "command"),
     (("--yes",), "lines", "--yes")],
)  # fmt: skip
def test_a_value_that_is_typed_is_on_record_with_the_consent_to_it(
    arm, monkeypatch, words, face, how
):
    with somebody_at(face, arm, monkeypatch) if face else nullcontext():
        done = arm.run("tool", "set", "1", "--x", "12.1", *words)
        assert done.code == 0, done.err
        wrote = arm.recorded(EntryKind.DONE)[0]
        (asked,) = [one for one in arm.recorded(EntryKind.DECISION) if "question" in one.details]
        assert WRITE in str(asked.details["question"])
        assert (asked.details["answer"], asked.details["answered_by"]) == ("yes", how)
        assert asked.change == wrote.change != ""
        # Undo asks a question too, recorded under the change that it makes.
        more = ("--yes",) if how != "person" else ()
        assert arm.run("undo", *more).code == 0
    undone = arm.recorded(EntryKind.DECISION)
    (asked,) = [
        one for one in undone if one.details.get("question") == "Write the old values back?"
    ]
    assert asked.details["answered_by"] == ("--yes" if more else "person")
    assert asked.change == arm.recorded(EntryKind.DONE)[0].change


def test_an_answer_that_nothing_follows_is_kept_nowhere(arm, monkeypatch):
    with somebody_at("lines", arm, monkeypatch):
        monkeypatch.setattr(Person, "poll", lambda *_: "n")
        assert arm.run("tool", "set", "1", "--x", "12.1").code == 9
    assert [one for one in arm.recorded(EntryKind.DECISION) if "question" in one.details] == []


def test_whoever_learns_a_station_has_the_answer_beside_its_place(arm, monkeypatch):
    with somebody_at("lines", arm, monkeypatch):
        done = arm.run("station", "learn", "PIN-07", "--tool", "1")
    assert done.code == 0, done.err
    asked = [str(one.details.get("question")) for one in arm.recorded(EntryKind.DECISION)]
    assert asked[0] == "Record this?"
    assert any(MOVES in question for question in asked)
