"""Answers to other questions: check lists, offers, writes, yes or no, texts. Pure.

Each returns the answer to be sent, or the state that only shows what became of a key or a line.
"""

from dataclasses import replace
from typing import Final

from robolink.calibration_run import WriteSubject
from robolink.messages import tr
from robolink.runner import BACK, MORE, FitSubject, Question
from robolink_cli.wizard.happenings import KeyPressed, Pressed, WizardCommand
from robolink_cli.wizard.keys import folded, meaning_of
from robolink_cli.wizard.state import (
    ARMED_AFTER_S,
    CHANGE_LANGUAGE,
    SWITCH_ON,
    CheckSubject,
    ChoiceSubject,
    LastScreen,
    Mark,
    WizardState,
)

Answered = WizardState | str

_WRITES: Final = frozenset({"*", "main"})

_OFFERED: Final = {
    ".": WizardCommand.SHOW_REPORT,
    "delete": WizardCommand.SHOW_REPORT,
    "+": WizardCommand.NEXT_TOOL,
}
_OFFERED_WORDS: Final = {"report": WizardCommand.SHOW_REPORT, "next": WizardCommand.NEXT_TOOL}

_LIKELY_SHARE: Final = 3.0
"""Ratio of the worst touch's deviation to each other one above which it is offered first."""

_LEAST_SHARE: Final = 1 / 3
"""Share of the limit that the worst touch's deviation must exceed to be offered first."""


def expected_number(subject: WriteSubject) -> str:
    """Return what must be typed before a write: the numbers of its tools, in order."""
    return "".join(map(str, subject.tools))


def offered_words(subject: WriteSubject) -> tuple[str, ...]:
    """Return the words by which a person may return to the touches before a write."""
    if subject.again is None:
        return ()
    return (BACK, MORE) if subject.can_add_touch else (BACK,)


def answered_by_key(state: WizardState, key: KeyPressed) -> Answered:
    """Return the answer of a key."""
    question, subject = state.question, state.subject
    if question is None:
        return state
    if isinstance(subject, ChoiceSubject):
        return _choice_key(state, subject, key)
    if question.kind is Question.TEXT:
        return _text_key(state, key)
    if isinstance(subject, WriteSubject):
        return _write_key(state, subject, key)
    if isinstance(subject, CheckSubject):
        return _check_key(state, subject, key)
    if isinstance(subject, FitSubject):
        return _fit_key(subject, key) or state
    return _yes_no_key(state, key)


def answered_by_line(state: WizardState, line: str) -> Answered:
    """Return the answer of a line."""
    question, subject = state.question, state.subject
    if question is None:
        return state
    if isinstance(subject, ChoiceSubject):
        word = folded(line)
        if not word and subject.safe is not None:
            return str(subject.safe + 1)
        if subject.other and meaning_of(line) == subject.other:
            return CHANGE_LANGUAGE
        known = word.isdigit() and 1 <= int(word) <= len(subject.options)
        return word if known else state.says(tr("Type the number of a row."))
    if question.kind is Question.TEXT:
        return line.strip() or state.says(tr("Nothing was typed."))
    meaning = meaning_of(line)
    if isinstance(subject, WriteSubject):
        word = {"again": BACK, "more": MORE}.get(meaning, "")
        if word in offered_words(subject):
            return word
        return _write(state, subject, folded(line), said_no=meaning == "no")
    if isinstance(subject, CheckSubject):
        return _check_line(state, subject, meaning, folded(line))
    if isinstance(subject, FitSubject) and meaning == "again":
        return "y"
    if isinstance(subject, FitSubject) and subject.more and meaning == "more":
        return MORE
    if meaning in ("yes", "no"):
        return meaning[0]
    return state.says(tr("Type y or n."))


def answered_by_press(state: WizardState, press: Pressed) -> Answered:
    """Return the answer of a press that the view offers; see ``views.offered``."""
    subject = state.subject
    match press.action, subject:
        case "choose", _:
            return press.value
        case "language", _:
            return CHANGE_LANGUAGE
        case "confirm", CheckSubject() as check:
            names = [point.name for point in check.rows]
            return _confirmed(state, check, names.index(press.value))
        case "write", WriteSubject() as writes:
            return _write(state, writes, folded(press.value), said_no=False)
        case "again", WriteSubject():
            return BACK
        case "answer", _:
            return press.value.strip() or state.says(tr("Nothing was typed."))
        case "more", _:
            return MORE
        case (("yes" | "start" | "again"), _):
            return "y"
        case _:
            return "n"  # no, reject, go_on


PRESSED_AT_THE_END: Final = {
    "finish": WizardCommand.LEAVE,
    "leave": WizardCommand.LEAVE,
    "begin_again": WizardCommand.BEGIN_AGAIN,
    "report": WizardCommand.SHOW_REPORT,
    "next": WizardCommand.NEXT_TOOL,
}
"""What the actions of the last screen choose."""


def chosen_by_key(state: WizardState, ended: LastScreen, key: KeyPressed) -> WizardCommand | None:
    """Return the choice of a key on the last screen, ``None`` for nothing; ENTER is none.

    A key that is still held down chooses nothing either.
    """
    if key.at_s - ended.at_s < ARMED_AFTER_S:
        return None
    if key.name in ("stop", "0", "q"):
        return WizardCommand.LEAVE
    if key.name in ("5", "main"):
        if ended.done:
            return WizardCommand.LEAVE
        return WizardCommand.BEGIN_AGAIN if ended.again else None
    offered = _OFFERED.get(key.name)
    return offered if ended.done and offered in state.offers else None


def chosen_by_line(state: WizardState, line: str) -> WizardCommand | None:
    """Return the choice of a line at the end of a job; an empty one chooses nothing."""
    meaning = meaning_of(line)
    if meaning in ("stop", "finish"):
        return WizardCommand.LEAVE
    offered = _OFFERED_WORDS.get(meaning)
    return offered if offered in state.offers else None


def worst_first(fit: FitSubject) -> bool:
    """Return whether the worst touch is so far off that repeating it comes first."""
    if fit.worst is None:
        return False
    away = [sum(part * part for part in row.off_mm) ** 0.5 for row in fit.rows]
    worst = away.pop(fit.worst)
    return worst > fit.limit_mm * _LEAST_SHARE and all(worst > _LIKELY_SHARE * one for one in away)


def _fit_key(fit: FitSubject, key: KeyPressed) -> str:
    """Return the answer of a key; empty for nothing. The key that continues moves nothing."""
    if key.name in ("5", "main", "n"):
        return "n"
    if key.name in ("/", "y"):
        return "y"
    return MORE if fit.more and key.name == "+" else ""


def _marked(state: WizardState, key: KeyPressed, rows: int, first: int = 0) -> WizardState | None:
    """Return the state after an arrow went to another row, ``None`` for another key.

    Args:
        state: The state.
        key: The key.
        rows: How many rows there are.
        first: Which one an arrow down goes to where none is marked.
    """
    marked = state.marked
    if key.name == "2":
        return replace(
            state, marked=first if marked is None else min(marked + 1, rows - 1), message=""
        )
    if key.name == "8":
        return replace(state, marked=rows - 1 if marked is None else max(marked - 1, 0), message="")
    return None


def _row_done(state: WizardState, key: KeyPressed, *, enters: bool = False) -> WizardState | None:
    """Return why a key does nothing on a list; ``None`` if it carries out its row."""
    if key.name == "enter" and not enters:
        return state.says(tr("ENTER does nothing here. [5] does what the marked row says."))
    if key.name not in ("5", "main", "enter"):
        return state
    return state.says(tr("Mark a row first.")) if state.marked is None else None


def _choice_key(state: WizardState, subject: ChoiceSubject, key: KeyPressed) -> Answered:
    """Mark a row with the arrows; choose the marked one."""
    moved = _marked(state, key, len(subject.options))
    if moved is not None:
        return moved
    if key.name == "f2" and subject.other:
        return CHANGE_LANGUAGE
    safe = state.marked is not None and state.marked == subject.safe
    refused = _row_done(state, key, enters=subject.enters or safe)
    return str((state.marked or 0) + 1) if refused is None else refused


def _yes_no_key(state: WizardState, key: KeyPressed) -> Answered:
    """Mark yes or no with the arrows, and choose it; a letter answers too."""
    said = {"y": "y", "j": "y", "n": "n"}.get(key.name)
    if said is not None:
        return said
    moved = _marked(state, key, 2)
    if moved is not None:
        return moved
    refused = _row_done(state, key)
    return "yn"[state.marked or 0] if refused is None else refused


def _text_key(state: WizardState, key: KeyPressed) -> Answered:
    if key.name == "enter":
        return state.typed.strip() or state.says(tr("Nothing was typed."))
    return into_field(state, key)


def into_field(state: WizardState, key: KeyPressed) -> WizardState:
    """Write a key into the field."""
    if key.name == "backspace":
        return replace(state, typed=state.typed[:-1], message="")
    return replace(state, typed=(state.typed + key.text)[:60], message="") if key.text else state


def _write_key(state: WizardState, subject: WriteSubject, key: KeyPressed) -> Answered:
    if key.name in _WRITES:
        return _write(state, subject, folded(state.typed), said_no=False)
    if key.name == "n":
        return "n"
    if key.name in (".", "delete"):
        return replace(state, page=state.page + 1, message="")
    word = {"/": BACK, "+": MORE}.get(key.name, "")
    if word in offered_words(subject):
        return word
    if key.text.isdigit() or key.name == "backspace":
        return into_field(state, key)
    return state  # ENTER never writes


def _write(state: WizardState, subject: WriteSubject, typed: str, *, said_no: bool) -> Answered:
    """Write only if the number of the tool was typed."""
    if said_no:
        return "n"
    numbers = "".join(part for part in typed if part not in " ,;")
    if numbers and numbers == expected_number(subject):
        return "y"
    wrong = replace(state, typed="")
    if not numbers:
        return wrong.says(tr("Type the number of the tool first. Nothing was written."))
    return wrong.says(
        tr('"{typed}" is not the number of the tool. Nothing was written.', typed=typed)
    )


def _check_key(state: WizardState, subject: CheckSubject, key: KeyPressed) -> Answered:
    """Mark a row with the arrows; do or confirm it, or start where none is open.

    No row is marked when the list is shown, and the mark stays where it is: a key that is held
    down, or meant for the list before, confirms nothing and never starts.
    """
    start, left = len(subject.rows), subject.open_rows(state.checked)
    moved = _marked(state, key, start + 1, first=left[0] if left else start)
    if moved is not None:
        return moved
    refused = _row_done(state, key)
    if refused is not None:
        return refused
    if state.marked is None or state.marked == start:
        return state.says(tr("Not yet: {n} open.", n=len(left))) if left else "y"
    return _confirmed(state, subject, state.marked)


def _check_line(state: WizardState, subject: CheckSubject, meaning: str, word: str) -> Answered:
    """Do or confirm the row of a number, or start where none is open."""
    if meaning == "no" or word == "0":
        return "n"
    if word.isdigit() and 1 <= int(word) <= len(subject.rows):
        said = _confirmed(state, subject, int(word) - 1)
        return said if isinstance(said, str) else said.says(_left_open(subject, said.checked))
    if meaning != "yes":
        return state.says(tr("Confirm each row first, by its number."))
    left = subject.open_rows(state.checked)
    return state.says(_left_open(subject, state.checked)) if left else "y"


def _confirmed(state: WizardState, subject: CheckSubject, index: int) -> Answered:
    """Carry out a row, or confirm it; a confirmed row is withdrawn."""
    point = subject.rows[index]
    if point.mark is Mark.TO_DO:
        return SWITCH_ON
    checked = state.checked ^ {point.name}
    settled = "" if subject.open_rows(checked) else tr("All rows are confirmed.")
    return replace(state, checked=checked, message=settled)


def _left_open(subject: CheckSubject, checked: frozenset[str]) -> str:
    rows = ", ".join(str(index + 1) for index in subject.open_rows(checked))
    return tr("Not yet. First: {keys}.", keys=rows) if rows else tr("All rows are confirmed.")
