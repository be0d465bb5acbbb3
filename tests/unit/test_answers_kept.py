"""No answer is forgotten: what asks, asks through what records, whoever calls it."""

import ast
from pathlib import Path

import pytest
import robolink_cli

import robolink
from robolink.journal import memory_journal
from robolink.model import (
    AnsweredBy,
    EntryKind,
    NewEntry,
    WorkBox,
    answer_entry,
    answered_by_in_words,
)
from robolink.runner import Confirm, Runner, RunSettings
from robolink.testing import MemoryController

PLACES = [Path(robolink.__file__).parent, Path(robolink_cli.__file__).parent]

PRIMITIVES = {
    "runner/_yes_no.py",
    "prompts/questions.py",
    "wizard/state.py",
    "session/check_before_start.py",
}
"""Where a person is asked for a word, and the answer is kept."""

NO_VALUE_RESTS_ON_IT = {
    "runner/_place_question.py",  # a place: the pose and how it was touched are in the measurement
    "commands/companions/check_map.py",  # what an HMI shows: kept with its map
}


class Person:
    """Says what is in the list."""

    def __init__(self, *words):
        self.words = list(words)

    def ask(self, question, kind):
        """Hear it."""

    def tell(self, text):
        """Hear it."""

    def poll(self, wait_s):
        return self.words.pop(0)


def runner_of(controller, *words, **more):
    settings = RunSettings(WorkBox(z_max_mm=200))
    return Runner(controller, controller.groups[0], Person(*words), settings, **more)


def said(controller):
    entries = controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
    return [(one.details["question"], one.details["answer"], one.tool) for one in entries]


def test_a_question_of_any_procedure_is_on_record_without_a_measurement():
    def asks():
        first = yield Confirm("Show both moves again?")
        second = yield Confirm("Take it again?", also=("more",))
        return first, second

    with MemoryController(identity="a procedure") as controller:
        assert runner_of(controller, "y", "more", tool=3).run(asks()) == (True, "more")
        assert said(controller) == [
            ("Take it again?", "more", 3),
            ("Show both moves again?", "yes", 3),
        ]


def test_each_way_to_ask_by_the_runner_is_on_record():
    with MemoryController(identity="each way") as controller:
        runner = runner_of(controller, "y", "n", "back", "N-1")
        assert runner.confirm("a?")
        assert runner.confirm_or("b?", also=("back",), decides="accepted") is False
        assert runner.confirm_or("c?", also=("back",), decides="accepted") == "back"
        assert runner.ask_text("d?") == "N-1"
        assert said(controller) == [
            ("d?", "N-1", None), ("c?", "back", None), ("b?", "no", None), ("a?", "yes", None),
        ]  # fmt: skip
        accepted = [
            entry.details.get("accepted")
            for entry in controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
        ]
        assert accepted == [None, None, False, None]


def test_nobody_asks_a_person_past_what_keeps_the_answer():
    found = set()
    for place in PLACES:
        for path in place.rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if "ask_yes_no" not in text and ".ask(" not in text:
                continue
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.Call) and _asks(node):
                    found.add(str(path.relative_to(place)))
    assert found == PRIMITIVES | NO_VALUE_RESTS_ON_IT


def _asks(call):
    """Whether it puts a question to an operator: ``x.ask(..., Question.Y)``, or a shown prompt."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name in ("ask_yes_no", "ask_yes_no_or"):
        return True
    kinds = (ast.dump(part) for part in call.args)
    return name == "ask" and any("Question" in kind or "_QUESTIONS" in kind for kind in kinds)


def an_answer(question="Write it?"):
    return answer_entry(question, True, AnsweredBy.PERSON)


def test_an_answer_waits_for_the_change_that_it_leads_to():
    log = memory_journal("answers-wait").log("a")
    log.answered(an_answer())
    log.append(NewEntry(EntryKind.BACKUP))
    assert [entry.kind for entry in log.recorded()] == [EntryKind.BACKUP]
    log.change = "c-1"
    log.append(NewEntry(EntryKind.INTENT, tool=1))
    assert [(one.kind, one.change) for one in log.recorded()] == [
        (EntryKind.INTENT, "c-1"), (EntryKind.DECISION, "c-1"), (EntryKind.BACKUP, ""),
    ]  # fmt: skip
    log.append(NewEntry(EntryKind.DONE, tool=1))
    assert len(list(log.recorded(kinds=(EntryKind.DECISION,)))) == 1, "once"


@pytest.mark.parametrize("kind", [EntryKind.STATION, EntryKind.DONE, EntryKind.NOT_APPLIED])
def test_without_a_change_it_goes_with_what_it_led_to(kind):
    log = memory_journal(f"answers-{kind}").log("a")
    log.answered(an_answer())
    log.append(NewEntry(kind))
    assert [entry.kind for entry in log.recorded()] == [kind, EntryKind.DECISION]


def test_an_answer_is_kept_where_the_transaction_failed():
    log = memory_journal("answers-fail").log("a")
    log.answered(an_answer())
    with pytest.raises(TypeError):
        log.append(NewEntry(EntryKind.STATION, details={"no": object()}))
    assert list(log.recorded()) == []
    log.append(NewEntry(EntryKind.STATION))
    assert [entry.kind for entry in log.recorded()] == [EntryKind.STATION, EntryKind.DECISION]


def test_each_way_of_answering_has_its_words():
    words = [answered_by_in_words(by) for by in AnsweredBy]
    assert len(set(words)) == len(words)
    assert answered_by_in_words("by post") == "by post"
