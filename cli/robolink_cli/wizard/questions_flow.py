"""Answers to questions that are no places: check lists, offers, writes, yes or no, texts. Pure.

Each returns the answer to be sent, or the state that only shows what became of a key or a line.
"""

from dataclasses import replace
from typing import Final

from robolink.messages import tr
from robolink.nozzle_change import WriteSubject
from robolink.runner import BACK, MORE, FitSubject, Question
from robolink_cli.wizard.check_list import SWITCH_ON, CheckSubject, Mark
from robolink_cli.wizard.choices import CHANGE_LANGUAGE, ChoiceSubject
from robolink_cli.wizard.happenings import KeyPressed, WizardCommand
from robolink_cli.wizard.keys import folded, meaning_of
from robolink_cli.wizard.state import ARMED_AFTER_S, LastScreen, WizardState

Answered = WizardState | str

_WRITES: Final = frozenset({"*", "main"})

_OFFERED: Final = {"1": WizardCommand.SHOW_REPORT, "3": WizardCommand.NEXT_TOOL}
_OFFERED_WORDS: Final = {"report": WizardCommand.SHOW_REPORT, "next": WizardCommand.NEXT_TOOL}

_LIKELY_SHARE: Final = 3.0
"""How many times as far off as each of the others the worst one is where it is offered first."""

_LEAST_SHARE: Final = 1 / 3
"""The share of the limit over which the worst one has to be off to be offered first."""


def expected_number(subject: WriteSubject) -> str:
    """Return what has to be typed before a write: the numbers of its tools, one after the other."""
    return "".join(map(str, subject.tools))


def offered_words(subject: WriteSubject) -> tuple[str, ...]:
    """Return the words by which a person may go back to the touches before a write."""
    if subject.again is None:
        return ()
    return (BACK, MORE) if subject.adds_touch else (BACK,)


def answered_by_key(state: WizardState, key: KeyPressed) -> Answered:
    """Return what a key answers."""
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
        return _check(state, subject, "main" if key.name == "5" else key.name)
    if isinstance(subject, FitSubject):
        return _fit_key(state, subject, key)
    return {"1": "y", "y": "y", "j": "y", "3": "n", "n": "n"}.get(key.name) or state.says(
        tr("Press [1] for yes or [3] for no.")
    )


def answered_by_line(state: WizardState, line: str) -> Answered:
    """Return what a line answers."""
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
        word = {"yes": "main", "no": "0"}.get(meaning, folded(line))
        return "n" if word == "0" else _check(state, subject, word)
    if isinstance(subject, FitSubject) and meaning == "again":
        return "y"
    if isinstance(subject, FitSubject) and subject.more and meaning == "more":
        return MORE
    if meaning in ("yes", "no"):
        return meaning[0]
    return state.says(tr("Type y or n."))


def chosen_by_key(state: WizardState, ended: LastScreen, key: KeyPressed) -> WizardCommand | None:
    """Return what a key chooses on the last screen, ``None`` for nothing; ENTER is none.

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
    """Return what a line chooses at the end of a job; an empty one chooses nothing."""
    meaning = meaning_of(line)
    if meaning in ("stop", "finish"):
        return WizardCommand.LEAVE
    offered = _OFFERED_WORDS.get(meaning)
    return offered if offered in state.offers else None


def worst_first(fit: FitSubject) -> bool:
    """Tell whether the worst one stands out so much that touching it again comes first."""
    if fit.worst is None:
        return False
    away = [sum(part * part for part in row.off_mm) ** 0.5 for row in fit.rows]
    worst = away.pop(fit.worst)
    return worst > fit.limit_mm * _LEAST_SHARE and all(worst > _LIKELY_SHARE * one for one in away)


def _fit_key(state: WizardState, fit: FitSubject, key: KeyPressed) -> Answered:
    first = worst_first(fit)
    answers = {"/": "y", "y": "y", "n": "n"} | ({"3": "n"} if first else {})
    answers |= dict.fromkeys(("5", "main"), "y" if first else "n")
    if fit.more:
        answers["1"] = MORE
    elif not first:
        answers["1"] = "y"
    return answers.get(key.name, state)


def _choice_key(state: WizardState, subject: ChoiceSubject, key: KeyPressed) -> Answered:
    """Mark a row with the arrows; take the marked one."""
    marked, last = state.marked, len(subject.options) - 1
    if key.name == "2":
        return replace(state, marked=0 if marked is None else min(marked + 1, last), message="")
    if key.name == "8":
        return replace(state, marked=last if marked is None else max(marked - 1, 0), message="")
    if key.name == "f2" and subject.other:
        return CHANGE_LANGUAGE
    if key.name == "enter" and not subject.enters and (marked is None or marked != subject.safe):
        return state.says(tr("ENTER does nothing here. [5] does what the marked row says."))
    if key.name in ("5", "main", "enter"):
        return state.says(tr("Mark a row first.")) if marked is None else str(marked + 1)
    return state


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
    """Write only where the number of the tool was typed."""
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


def _check(state: WizardState, subject: CheckSubject, word: str) -> Answered:
    """Confirm a point, or start where none is open."""
    for point in subject.points:
        if point.key != word:
            continue
        if point.mark is Mark.TO_DO:
            return SWITCH_ON
        checked = state.checked ^ {word}
        return replace(state, checked=checked, message=_left_open(subject, checked))
    if word != "main":
        return state.says(tr("Confirm each row first, by its number."))
    left = subject.open_keys(state.checked)
    return state.says(_left_open(subject, state.checked)) if left else "y"


def _left_open(subject: CheckSubject, checked: frozenset[str]) -> str:
    keys = " ".join(f"[{key}]" for key in subject.open_keys(checked))
    return tr("Not yet. First: {keys}.", keys=keys) if keys else tr("All rows are confirmed.")
