"""Asks a person for a word: what counts as a yes and as a no, and the record of the answer."""

import unicodedata
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy, OutcomeLog, answer_entry
from robolink.runner._place_question import MOST_REFUSED, ended_by_operator
from robolink.runner._prompt_context import (
    GuidedOperator,
    OfferedChoice,
    Operator,
    Question,
    regard,
)

_YES: Final = frozenset({"y", "yes", "j", "ja", "是"})
MORE: Final = "more"
"""The word for one more touch than planned."""

BACK: Final = "back"
"""The word for returning to the touches."""

_NO: Final = frozenset({"n", "no", "nein", "否"})


def yes_or_no(line: str) -> bool | None:
    """Return the meaning of a typed line; ``None`` for neither a yes nor a no."""
    word = line.strip().casefold()
    if word in _YES:
        return True
    return False if word in _NO else None


def ask_yes_no(operator: Operator, question: str, answer: Callable[[], str]) -> bool:
    """Ask; an answer that is neither yes nor no is asked once more, then it is a no.

    A barcode or a key held down is neither, and must not decide anything.

    Args:
        operator: Who is asked.
        question: What a yes agrees to.
        answer: Fetches the next line that the person types.

    Example:
        >>> from robolink.runner import ask_yes_no
        >>> class Person:
        ...     def ask(self, question, kind):
        ...         print(question)
        ...     def tell(self, text):
        ...         print(text)
        >>> ask_yes_no(Person(), "Write tool 1?", lambda: "y")
        Write tool 1?
        True
    """
    return ask_yes_no_or(operator, question, answer, also=()) is True


def ask_yes_no_or(
    operator: Operator, question: str, answer: Callable[[], str], *, also: Collection[str]
) -> bool | str:
    """Ask as :func:`ask_yes_no` does, a person who may also answer with a further word.

    Args:
        operator: Who is asked.
        question: What a yes agrees to.
        answer: Fetches the next line that the person types.
        also: The words; one of them is returned as it stands here.

    Example:
        >>> from robolink.runner import ask_yes_no_or
        >>> class Panel:  # implements robolink.Operator
        ...     def ask(self, question, kind):
        ...         print(question)
        >>> lines = iter(["more"])
        >>> ask_yes_no_or(Panel(), "Keep it?", lambda: next(lines), also=("more",))
        Keep it?
        'more'
    """
    for left in (1, 0):
        operator.ask(question, Question.YES_NO)
        line = answer().strip()
        if line in also:
            return line
        said = yes_or_no(line)
        if said is not None or not left:
            break
        operator.tell(
            tr(
                "{line!r} is neither yes nor no. It is asked once more; then anything but a yes "
                "counts as no.",
                line=line,
            )
        )
    return said is True


@dataclass(frozen=True, slots=True)
class Asking:
    """Questions to one person.

    Whoever asks through it cannot forget the record (docs/reference/journal.md 6).

    Attributes:
        operator: Who is asked.
        line: Fetches what is typed, looking after the controller meanwhile.
        outcomes: Where the answers go.
        tool: The tool that they are about; ``None`` for none or several.
    """

    operator: Operator
    line: Callable[[], str]
    outcomes: OutcomeLog
    tool: int | None = None

    def confirm_or(self, question: str, *, also: Collection[str], decides: str = "") -> bool | str:
        """Ask a yes-or-no question that a further word may answer; see :func:`ask_yes_no_or`.

        Args:
            question: What a yes agrees to.
            also: The words.
            decides: Under which name the record says besides whether it was a yes; empty for none.

        Raises:
            ConfigError: The answer cannot be recorded.

        Example:
            >>> from robolink.journal import memory_journal
            >>> from robolink.runner._yes_no import Asking
            >>> class Panel:  # implements robolink.Operator
            ...     def ask(self, question, kind):
            ...         print(question)
            >>> log = memory_journal("asking-example").log("a")
            >>> Asking(Panel(), lambda: "y", log).confirm_or("Keep it?", also=())
            Keep it?
            True
            >>> [entry.details["answer"] for entry in log.recorded()]
            ['yes']
        """
        said = ask_yes_no_or(self.operator, question, self.line, also=also)
        decided = {decides: said} if decides and isinstance(said, bool) else {}
        self._record(question, said, **decided)
        return said

    def choose(self, question: str, offered: OfferedChoice) -> int:
        """Let a person choose a row; return its index, 0 if no other was clearly meant.

        Args:
            question: What is asked.
            offered: The rows; the first is the safe one.

        Raises:
            ConfigError: The answer cannot be recorded.

        Example:
            >>> from robolink.journal import memory_journal
            >>> from robolink.runner import ChoiceRow, OfferedChoice
            >>> from robolink.runner._yes_no import Asking
            >>> class Panel:  # implements robolink.Operator
            ...     def ask(self, question, kind):
            ...         print(question)
            >>> rows = ChoiceRow("Take it back.", "As before."), ChoiceRow("Keep it.", "As it is.")
            >>> log = memory_journal("choosing-example").log("a")
            >>> Asking(Panel(), lambda: "2", log).choose("And now?", OfferedChoice("Test", rows))
            And now?
              1 Take it back.
                As before.
              2 Keep it.
                As it is.
            1
        """
        guided = isinstance(self.operator, GuidedOperator)
        shown = question if guided else "\n".join((question, *_listed(offered)))
        chosen = None
        for left in (1, 0):
            regard(self.operator, [offered])
            self.operator.ask(shown, Question.CHOICE)
            line = self.line().strip()
            chosen = _row_meant(line, len(offered.rows))
            if chosen is not None or not left:
                break
            self.operator.tell(
                tr(
                    "{line!r} is not the number of a row. It is asked once more; then anything "
                    "else counts as 1.",
                    line=line,
                )
            )
        row = chosen or 0
        self._record(question, offered.rows[row].does)
        return row

    def text(self, question: str) -> str:
        """Ask for a line of text.

        Raises:
            ConfigError: The answer cannot be recorded.
            DeclinedError: The person ended it with ``q``, or gave none however often asked.
        """
        for _ in range(MOST_REFUSED):
            self.operator.ask(question, Question.TEXT)
            text = self.line().strip()
            if text == "q":
                raise ended_by_operator()
            if text:
                self._record(question, text)
                return text
        raise DeclinedError(
            tr("Nothing was typed, {count} times in a row.", count=MOST_REFUSED),
            remedy=tr("Start again when somebody is there to answer."),
        )

    def _record(self, question: str, answer: bool | str, **details: object) -> None:
        by = getattr(self.operator, "answers_as", AnsweredBy.PERSON)
        self.outcomes.append(answer_entry(question, answer, by, tool=self.tool, **details))


def _listed(offered: OfferedChoice) -> list[str]:
    rows = enumerate(offered.rows, start=1)
    return [line for k, row in rows for line in (f"  {k} {row.does}", f"    {row.detail}")]


def _row_meant(line: str, count: int) -> int | None:
    """Return the index of the row that a line means, ``None`` for none."""
    word = unicodedata.normalize("NFKC", line)
    if word in ("", "q"):
        return 0
    known = word.isascii() and word.isdigit() and 1 <= int(word) <= count
    return int(word) - 1 if known else None
