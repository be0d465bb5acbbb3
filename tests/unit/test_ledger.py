"""The state of a controller: no answer is forgotten, and open blocks send signs of life."""

import ast
import threading
from pathlib import Path

import pytest
import robolink_cli
from robolink_simulators.cell.clock import ManualClock

import robolink
from robolink.controller_outcome import UNTOUCHED, Effect, outcome_after
from robolink.controllers import SimpleController
from robolink.controllers.driver_link import SignsOfLife
from robolink.errors import TransportClosedError
from robolink.journal import memory_journal
from robolink.model import (
    AnsweredBy,
    EntryKind,
    Ledger,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    WorkBox,
    answer_entry,
    answered_by_in_words,
    describe_outcome,
    plain_offset,
)
from robolink.runner import Confirm, Runner, RunSettings
from robolink.runtime import in_a_thread, replaced
from tests._rows import each_row
from tests.contract._quiet_time import QuietTime

# The state of a controller follows from what was begun, answered, read and recorded.

OLD, NEW = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.5, -3.5, -20.0)
WHEN = "2026-01-01T00:00:00+00:00"


def write(tool=1, before=OLD, requested=NEW, operation="w"):
    details = {"tool": tool, "before": plain_offset(before), "requested": plain_offset(requested)}
    return Marker(operation, MarkerKind.SET, f"TLSet {tool}", WHEN, details)


def select(tool, before, operation="s"):
    return Marker(
        operation, MarkerKind.SET, f"Tool {tool}", WHEN, {"select": tool, "before": before}
    )


def move(operation="m"):
    return Marker(operation, MarkerKind.MOVE, "Go P1", WHEN)


@pytest.fixture
def ledger():
    return Ledger()


def done(ledger, marker, found):
    ledger.begin(marker)
    ledger.answered(marker)
    ledger.proved(marker, found)
    ledger.ended(marker)
    ledger.recorded(marker)


def test_nothing_begun_is_untouched(ledger):
    assert ledger.outcome() == UNTOUCHED
    assert ledger.outcome().untouched


def test_a_write_is_unknown_until_it_is_read_and_settled_when_it_is_recorded(ledger):
    marker = write()
    ledger.begin(marker)
    assert (ledger.outcome().effect, ledger.outcome().settled) == (Effect.UNKNOWN, False)
    ledger.proved(marker, NEW)
    assert (ledger.outcome().effect, ledger.outcome().settled) == (Effect.CHANGED, False)
    ledger.ended(marker)
    assert not ledger.outcome().settled, "its marker is still there"
    ledger.recorded(marker)
    outcome = ledger.outcome()
    assert (outcome.effect, outcome.settled) == (Effect.CHANGED, True)
    assert outcome.tools[1].holds == NEW.components()


def test_a_refused_write_changed_nothing(ledger):
    marker = write()
    ledger.begin(marker)
    ledger.ended(marker)
    ledger.recorded(marker)
    assert (ledger.outcome().effect, ledger.outcome().settled) == (Effect.UNCHANGED, True)
    assert not ledger.outcome().untouched


def test_a_tool_that_is_read_settles_a_doubt_only_when_the_controller_was_done_with_it(ledger):
    marker = write()
    ledger.begin(marker)
    ledger.saw_tool(1, OLD)
    assert ledger.outcome().effect is Effect.UNKNOWN, "the write may still be on its way"
    ledger.answered(marker)
    ledger.saw_tool(1, OLD)
    assert ledger.outcome().effect is Effect.UNCHANGED
    assert ledger.open_writes(1) == (marker,)


def test_a_value_that_was_put_back_is_no_change(ledger):
    done(ledger, write(), NEW)
    done(ledger, write(before=NEW, requested=OLD, operation="back"), OLD)
    assert ledger.outcome().effect is Effect.UNCHANGED


def test_what_nobody_kept_is_not_settled_until_it_is_put_back(ledger):
    account = ledger.open()
    done(ledger, write(), NEW)
    ledger.close(account, kept=False)
    assert not ledger.outcome().settled
    done(ledger, write(before=NEW, requested=OLD, operation="back"), OLD)
    assert ledger.outcome().settled


def test_an_account_tells_only_of_its_own_block(ledger):
    done(ledger, write(), NEW)
    with pytest.raises(OSError, match="disk") as caught, ledger.block():
        raise OSError("disk")
    assert outcome_after(caught.value).effect is Effect.UNCHANGED
    assert ledger.outcome().effect is Effect.CHANGED


def test_ctrl_c_carries_what_stands_too(ledger):
    with pytest.raises(KeyboardInterrupt) as caught, ledger.block():
        ledger.begin(move())
        raise KeyboardInterrupt
    assert outcome_after(caught.value).moving == ("Go P1",)


def test_a_movement_that_ended_changes_nothing_that_is_kept(ledger):
    ledger.begin(move())
    assert ledger.outcome().effect is Effect.UNKNOWN
    ledger.ended(move())
    ledger.recorded(move())
    assert (ledger.outcome().effect, ledger.outcome().moved) == (Effect.UNCHANGED, True)


def test_a_selection_is_known_when_it_is_read(ledger):
    ledger.begin(select(0, before=1))
    assert not ledger.outcome().selection_known
    ledger.proved(select(0, before=1), 0)
    ledger.ended(select(0, before=1))
    ledger.recorded(select(0, before=1))
    assert (ledger.outcome().effect, ledger.outcome().selected) == (Effect.CHANGED, 0)
    done(ledger, select(1, before=0, operation="back"), 1)
    assert (ledger.outcome().effect, ledger.outcome().selected) == (Effect.UNCHANGED, 1)


def test_an_undefined_tool_is_a_value_like_any_other(ledger):
    done(ledger, write(before=None), NEW)
    assert ledger.outcome().effect is Effect.CHANGED
    done(ledger, write(before=NEW, requested=None, operation="back"), None)
    assert ledger.outcome().effect is Effect.UNCHANGED


def in_doubt(ledger):
    ledger.saw_selected(1)
    ledger.begin(write())


def changed(ledger):
    done(ledger, write(), NEW)


def tool_zero(ledger):
    ledger.begin(Marker("p", MarkerKind.SELECTION, "calibrate tool 1", WHEN, {"tool": 1}))
    done(ledger, select(0, before=1), 0)


def on_the_way(ledger):
    ledger.begin(move())


def output(ledger):
    done(ledger, Marker("o", MarkerKind.SET, "SetIO,8,1", WHEN, {"item": ["output", "8"]}), True)


@pytest.mark.parametrize(
    ("story", "sentence"),
    [
        (
            lambda ledger: None,
            "Nothing moved. Nothing was written. Selected tool: not checked.",
        ),
        (
            in_doubt,
            (
                "Nothing moved. Tool 1 may hold the new value X 12.500 Y -3.500 Z -20.000 U "
                "0.000; before, it held X 12.000 Y -3.500 Z -20.000 U 0.000. Tool 1 is "
                "selected. Next: robolink recover."
            ),
        ),
        (
            changed,
            (
                "Nothing moved. Tool 1 now holds X 12.500 Y -3.500 Z -20.000 U 0.000; before, "
                "it held X 12.000 Y -3.500 Z -20.000 U 0.000. Selected tool: not checked."
            ),
        ),
        (
            tool_zero,
            (
                "Nothing moved. Nothing was written. Tool 0 is selected now; it was tool 1 "
                "before. Next: robolink recover."
            ),
        ),
        (
            on_the_way,
            (
                "The robot may still be moving; robolink did not see the end of: Go P1. "
                "Nothing was written. Selected tool: not checked. Next: robolink recover."
            ),
        ),
        (
            output,
            "Nothing moved. This was carried out: SetIO,8,1. Selected tool: not checked.",
        ),
    ],
)
def test_what_stands_is_said_in_whole_sentences(ledger, story, sentence):
    story(ledger)
    assert describe_outcome(ledger.outcome()) == sentence


def test_what_two_connections_left_is_told_as_one():
    first, second = Ledger(), Ledger()
    done(first, write(), NEW)
    first.begin(move())
    first.ended(move())
    second.begin(write(before=NEW, requested=OLD))
    whole = first.outcome().followed_by(second.outcome())
    assert whole.moved
    assert (whole.tools[1].before, whole.tools[1].known) == (OLD.components(), False)
    assert whole.effect is Effect.UNKNOWN
    done(second, write(before=NEW, requested=OLD), OLD)
    whole = first.outcome().followed_by(second.outcome())
    assert (whole.tools[1].differs, whole.effect) == (False, Effect.UNCHANGED)


def test_what_one_connection_did_not_look_at_is_as_the_one_before_left_it():
    first, second = Ledger(), Ledger()
    done(first, select(0, 1), 0)
    done(second, write(), NEW)
    whole = first.outcome().followed_by(second.outcome())
    assert (whole.selected, whole.selected_before, whole.effect) == (0, 1, Effect.CHANGED)
    back = whole.put_back()
    assert (back.selected, back.effect, back.left_open) == (1, Effect.UNCHANGED, False)
    assert describe_outcome(back).endswith("as before. Tool 1 is selected.")


# No answer is forgotten: every function that asks records through the same one, whoever calls it.

PLACES = [Path(robolink.__file__).parent, Path(robolink_cli.__file__).parent]

PRIMITIVES = {
    "runner/_yes_no.py",
    "prompts/questions.py",
    "wizard/state.py",
    "session/check_before_start.py",
}
"""The functions that ask a person and keep the answer."""

NO_VALUE_RESTS_ON_IT = {
    "runner/_place_question.py",  # a place: the pose and how it was touched are in the measurement
    "commands/companions/check_map.py",  # a value on an HMI: kept with its map
}


class Person:
    """Answers from a list."""

    def __init__(self, *words):
        self.words = list(words)

    def ask(self, question, kind):
        """Accept a question."""

    def tell(self, text):
        """Accept a message."""

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
        second = yield Confirm("Repeat it?", also=("more",))
        return first, second

    with SimpleController(identity="a procedure") as controller:
        assert runner_of(controller, "y", "more", tool=3).run(asks()) == (True, "more")
        assert said(controller) == [
            ("Repeat it?", "more", 3),
            ("Show both moves again?", "yes", 3),
        ]


def test_each_way_to_ask_by_the_runner_is_on_record():
    with SimpleController(identity="each way") as controller:
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
    """Whether the call asks an operator: ``x.ask(..., Question.Y)``, or a displayed prompt."""
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


@each_row("kind", [EntryKind.STATION, EntryKind.DONE, EntryKind.NOT_APPLIED])
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


# Signs of life: one thread for all open blocks of a controller, and none without a block.

LONGEST_S = 30.0


@pytest.fixture
def time():
    time = QuietTime(ManualClock())
    with replaced(time):
        yield time


def test_they_are_given_within_a_block_and_never_after_it(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(time.now_ns()))
    time.sleep(2)
    with signs.shown():
        time.sleep(3)
    time.sleep(3)
    assert len(given) == 3


def test_blocks_inside_of_a_block_give_no_more(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    with signs.shown():
        with signs.shown(), signs.shown():
            assert time.going_on == 1
        time.sleep(1)
        assert time.going_on == 1
    assert (len(given), time.going_on) == (1, 0)


def test_one_that_cannot_be_given_does_not_hinder_the_next(time):
    tried: list[object] = []

    def fails():
        tried.append(None)
        raise TransportClosedError("The link is gone.")

    with SignsOfLife(fails).shown():
        time.sleep(3)
    assert len(tried) == 3


def test_a_thread_that_ended_in_its_block_gives_none(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    left_open = signs.shown()
    thread = threading.Thread(target=left_open.__enter__)
    thread.start()
    thread.join()
    time.sleep(3)
    assert given == []
    left_open.gen.close()


def test_a_block_of_another_thread_goes_on_when_one_is_left(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    inside, leave = threading.Event(), threading.Event()

    def work():
        with signs.shown():
            inside.set()
            leave.wait(LONGEST_S)

    thread = threading.Thread(target=work)
    thread.start()
    with signs.shown():
        inside.wait(LONGEST_S)
    time.sleep(1)
    leave.set()
    thread.join()
    time.sleep(1)
    assert len(given) == 1


def test_the_thread_ends_with_the_block_and_never_keeps_a_process():
    acted = threading.Event()
    end = in_a_thread(0.001, acted.set, "signs of life")
    (thread,) = (one for one in threading.enumerate() if one.name == "signs of life")
    assert thread.daemon
    assert acted.wait(LONGEST_S)
    end()
    assert not thread.is_alive()
