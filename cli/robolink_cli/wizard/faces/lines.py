"""The wizard as a dialogue of lines: for a dumb terminal, a narrow one, a screen reader."""

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from robolink.interrupts import EndedBy, end, ended_by
from robolink.messages import tr
from robolink.runner import Question
from robolink_cli.console.output import draw, sentences, terminal_width
from robolink_cli.prompts.lines import QUIET_S, Lines, open_lines
from robolink_cli.wizard.ending import ended_of
from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.happenings import (
    Effect,
    Happening,
    HasEnded,
    LineTyped,
    SendAnswer,
    WaitsForAnswer,
    WasAsked,
    WasRegarded,
    WasTold,
    WizardCommand,
)
from robolink_cli.wizard.screens.end import told_end
from robolink_cli.wizard.screens.layout import WIDTH
from robolink_cli.wizard.screens.sentences import told_after_jog, told_before, told_question
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Desk

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Work


_END: Final = WizardCommand.END_WORK


def carry_out(desk: Desk, effects: list[Effect]) -> None:
    """Send answers, or end the work."""
    for effect in effects:
        if isinstance(effect, SendAnswer):
            desk.answer(effect)
        elif effect is _END:
            end(EndedBy.CTRL_C)


def leaves(effects: list[Effect]) -> bool:
    """Return whether a person leaves the last screen, for good or for a choice on it."""
    return any(isinstance(one, WizardCommand) for one in effects if one is not _END)


_TURN_S: Final = 0.05
_STEADY_S: Final = 0.5
"""Time in seconds for which a window must be large enough before a screen is drawn in it. A person
dragging the window's edge is slow.
"""


class LineFace:
    """Shows a desk line after line, on stderr.

    Attributes:
        handed_back: Whether it ended because a screen has room again.

    Args:
        has_room: Tells whether the window has room for a screen; ``None`` where none is wanted.
    """

    def __init__(self, has_room: Callable[[], bool] | None = None) -> None:
        self._lines: Lines | None = None
        self._shown = 0
        self._has_room = has_room
        self._room_since_s: float | None = None
        self.handed_back = False

    def run(self, desk: Desk, state: WizardState, work: "Work[Any]") -> WizardState:
        """Show it until the work has ended; return the last state."""
        if state.ended is None and state.question is not None and state.waits:
            # Taken over from a screen that has become too small.
            self._begin_question(state, state.question.kind)
            self._shown = state.question.number
            _put(told_question(state))
        while True:
            ended = work.ended
            for happening in desk.happened():
                state, effects = advance(state, happening)
                self._tell(happening, state)
                carry_out(desk, effects)
            if ended:
                # Everything that was shown is above.
                return self._at_the_end(replace(state, fresh=()), work)
            if self._screen_may_follow():
                return state
            if state.question is None or not state.waits:
                work.wait(_TURN_S)
                continue
            state = self._listen(desk, state)

    def _screen_may_follow(self) -> bool:
        """Return whether a screen has had room for a while; discard what was typed by then."""
        now_s = time.monotonic()
        if self._has_room is None or not self._has_room():
            self._room_since_s = None
            return False
        if self._room_since_s is None:
            self._room_since_s = now_s
        if now_s - self._room_since_s < _STEADY_S:
            return False
        # A line started here would arrive as keys on the screen.
        self._forget(0.0)
        self.handed_back = True
        return True

    def _listen(self, desk: Desk, state: WizardState) -> WizardState:
        assert self._lines is not None  # noqa: S101 - opened with the first question
        try:
            line = self._lines.next(_TURN_S)
        except EOFError:
            desk.leave()
            return state
        if line is None:
            return state
        typed = LineTyped(line, time.monotonic())
        state, effects = advance(state, typed)
        carry_out(desk, effects)
        if not effects:
            if state.at_place and not line.strip():
                _put(told_after_jog(state))
            elif state.message:
                _put(state.message)
        return state

    def _at_the_end(self, state: WizardState, work: "Work[Any]") -> WizardState:
        """Ask what comes after a finished job; any other end is shown in lines alone."""
        ended = state.ended or ended_of(state, work.error, time.monotonic())
        if ended is None or not ended.done or not state.offers or ended_by() is not None:
            return state
        for row in (*ended.kept, state.message):
            _put(row)
        # Shown now, and not again when the dialogue is over.
        state, _ = advance(state, HasEnded(replace(ended, kept=())))
        self._begin_question(state, Question.TEXT)
        _put(told_end(state))
        assert self._lines is not None  # noqa: S101 - opened with the question
        while ended_by() is None:
            try:
                line = self._lines.next(_TURN_S)
            except EOFError:
                break
            if line is None:
                continue
            state, effects = advance(state, LineTyped(line, time.monotonic()))
            if leaves(effects):
                break
            _put(state.message)
            _put(told_end(state))
        return state

    def _tell(self, happening: Happening, state: WizardState) -> None:
        """Show a happening to a person without a screen."""
        match happening:
            case WasTold(text=text):
                self._forget(0.0)
                _put(text)
            case WasAsked(kind=kind):
                self._begin_question(state, kind)
            case WaitsForAnswer(number=number) if number != self._shown:
                self._shown = number
                self._forget(0.0)
                _put(told_question(state))
            case WaitsForAnswer() if state.at_place:
                # A step typed during the movement is not executed.
                self._forget(0.0)
                _put(told_after_jog(state))
            case WasRegarded():
                pass
            case _:
                pass

    def _begin_question(self, state: WizardState, kind: Question) -> None:
        if self._lines is None:
            self._lines = open_lines()
        self._forget(QUIET_S)
        if kind in (Question.YES_NO, Question.TEXT, Question.CHOICE):
            for row in told_before(state, terminal_width(sys.stderr) or WIDTH):
                _put(row)

    def _forget(self, quiet_s: float) -> None:
        if self._lines is None:
            return
        for line in self._lines.forget(quiet_s):
            if line.strip():
                _put(tr("Typed too early and ignored: {line!r}", line=line))


def _put(text: str) -> None:
    if text:
        draw(sentences(text), beside=True)
