"""A program that calls back is answered although the record of its robot was lost."""

from typing import cast

import pytest

from robolink.errors import JournalError, OutcomeUnknownError, RobolinkError
from robolink.journal import Journal
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits

PUT_NOTHING_BACK, SAYS_IT_KEPT = "1", "2"


class RefusingRecord:
    """A log to which nothing can be added before a person has done something."""

    def __init__(self, error):
        self.error = error

    def ask(self, who):
        """Take who the robot is."""

    def open_markers(self):
        """Return what is open: nothing is."""
        return ()

    def append(self, *entries):
        """Refuse."""
        raise self.error


class RefusingJournal:
    """Gives nothing but such a log."""

    def __init__(self, error):
        self.error = error

    def log(self, controller, *, signature):
        """Return it."""
        return RefusingRecord(self.error)


MISSING = OutcomeUnknownError("the record of before is missing", remedy="look")
DAMAGED = JournalError("the journal is damaged", remedy="move it away")


def hello(flag):
    value = ("12000", "-3500", "-20000", "0", "0", "0")
    return CallbackLine(1, CallbackWord.HELLO, ("SIM1", "1", flag, "none", "1", "1", *value))


def talk(error, tell):
    journal = cast(Journal, RefusingJournal(error))
    return CallbackConversation(journal, CallbackLimits(), peer="here", tell=tell)


@pytest.mark.parametrize(("error", "code"), [(MISSING, "unsettled"), (DAMAGED, "journal")])
def test_a_refusal_that_cannot_be_recorded_is_answered_and_a_person_is_told_why(error, code):
    told: list[tuple[str, RobolinkError]] = []
    conversation = talk(error, lambda *refusal: told.append(refusal))
    answer = conversation.answer(hello(PUT_NOTHING_BACK))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, (code,))
    (first, _), second = told
    assert first == "not_restored"
    assert second == (code, error)


def test_a_journal_that_is_refused_for_its_damage_is_told_once():
    told: list[tuple[str, RobolinkError]] = []
    conversation = talk(DAMAGED, lambda *refusal: told.append(refusal))
    answer = conversation.answer(hello(SAYS_IT_KEPT))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, ("journal",))
    assert told == [("journal", DAMAGED)]


def test_a_screen_that_is_gone_ends_no_conversation():
    def gone(_code, _error):
        raise BrokenPipeError

    assert talk(DAMAGED, gone).answer(hello(PUT_NOTHING_BACK)).word == CallbackWord.REFUSE
