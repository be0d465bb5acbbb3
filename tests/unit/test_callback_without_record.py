"""A program that calls back is answered although the record of its robot was lost."""

from typing import cast

from robolink.errors import OutcomeUnknownError
from robolink.journal import Journal
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits

PUT_NOTHING_BACK = "1"


class LostRecord:
    """A log to which nothing can be added before a person has looked."""

    def ask(self, who):
        """Take who the robot is."""

    def append(self, *entries):
        """Refuse."""
        raise OutcomeUnknownError("the record of before is missing", remedy="look")


class LosingJournal:
    """Gives nothing but such a log."""

    def log(self, controller, *, signature):
        """Return it."""
        return LostRecord()


def test_a_refusal_that_cannot_be_recorded_is_answered_all_the_same():
    talk = CallbackConversation(cast(Journal, LosingJournal()), CallbackLimits(), peer="here")
    value = ("12000", "-3500", "-20000", "0", "0", "0")
    fields = ("SIM1", "1", PUT_NOTHING_BACK, "none", "1", "1", *value)
    answer = talk.answer(CallbackLine(1, CallbackWord.HELLO, fields))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, ("unsettled",))
