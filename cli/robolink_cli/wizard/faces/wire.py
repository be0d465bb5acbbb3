"""The wizard at the other end of a wire: views go out, presses come in."""

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import RobolinkError
from robolink.interrupts import EndedBy, ended_by
from robolink.messages import tr
from robolink_cli.wizard.ending import ended_of, headed_of, is_blocked, stopped_lines
from robolink_cli.wizard.faces.lines import carry_out, leaves
from robolink_cli.wizard.faces.link import WireLink
from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.happenings import Happening, HasEnded, Pressed, WasTold
from robolink_cli.wizard.lease import LONGEST_HELD_STEP
from robolink_cli.wizard.state import ARMED_AFTER_S, LastScreen, WizardState
from robolink_cli.wizard.views.records import EndView, QuestionView, View, WaitView
from robolink_cli.wizard.views.view import view_of
from robolink_cli.wizard.views.wire import to_wire
from robolink_cli.wizard.work import Desk

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Work

_TURN_S: Final = 0.02
_AT_LEAST_S: Final = 0.1
"""Shortest time in seconds between two views."""

_FRESH_S: Final = 0.5
"""Age in seconds above which a press is not carried out any more."""

_AGE_S: Final = 0.3
"""Interval in seconds at which a view is sent of which nothing but the age has changed."""

_OTHERS: Final = frozenset({EndedBy.TERMINATED, EndedBy.HUNG_UP})
"""Endings by whoever started this process, who waits for its end."""

_LONGEST_TOLD: Final = 8000
_MOST_CUTS: Final = 40
"""How often a view is made shorter until it fits into a line."""


class WireFace:
    """Shows a desk to whoever is at the other end of a wire.

    Args:
        link: The wire.
    """

    def __init__(self, link: WireLink) -> None:
        self._link = link
        self._sent: View | None = None
        self._sent_s = self._looked_s = 0.0
        self._changed = True
        self._left = False
        self._stepped: int | None = None

    def run(self, desk: Desk, state: WizardState, work: "Work[Any]") -> WizardState:
        """Show it until the work has ended and a person has left the last screen."""
        self._desk, self._state, self._work = desk, state, work
        self._left, self._changed = False, True
        desk.silent_s = self._link.silent_s
        while True:
            ended = work.ended  # before what happened is asked for, so that nothing is missed
            for happening in desk.happened():
                self._happens(happening)
            for press in self._link.presses():
                self._press(press)
            if ended and self._state.ended is None:
                last = last_screen(self._state, work.error, time.monotonic())
                self._happens(HasEnded(last))
            if self._link.left:
                desk.leave()
                if ended:
                    return self._state
            elif ended and (self._left or ended_by() in _OTHERS):
                self._sent_s = -_AT_LEAST_S
                self._show()
                return self._state
            self._jog_held()
            self._show()
            self._link.came.wait(_TURN_S)
            self._link.came.clear()

    def _happens(self, happening: Happening) -> None:
        if isinstance(happening, WasTold):
            self._link.send({"t": "told", "text": happening.text[:_LONGEST_TOLD]})
        self._changed = True
        self._state, effects = advance(self._state, happening)
        carry_out(self._desk, effects)
        self._left |= leaves(effects)

    def _press(self, press: Pressed) -> None:
        """Carry out a press; one that had to wait is none any more, but for the way out."""
        if time.monotonic() - press.at_s <= _FRESH_S or press.action == "leave":
            self._happens(press)
            return
        self._changed = True
        self._state = self._state.says(tr("Pressed while this computer was busy. Press it again."))

    def _jog_held(self) -> None:
        """Send the next step of a key that is held, when the last one has ended."""
        hold, state, now_s = self._link.held(), self._state, time.monotonic()
        if hold is None:
            self._stepped = None
            return
        question = state.question
        if question is None or not state.at_place or question.number != hold.number:
            self._link.end_held()
            return
        if state.waits and self._stepped == state.jogging.steps:
            self._link.end_held()  # the step was not made: at a limit, or not permitted
            self._stepped = None
            return
        if not state.waits or now_s - question.at_s < ARMED_AFTER_S:
            return
        if not self._link.spend_sign():
            return
        step = min(state.jogging.step, LONGEST_HELD_STEP)
        self._happens(Pressed(hold.number, "jog", f"{hold.axis}{step:g}", now_s))
        self._stepped = None if self._state.waits else state.jogging.steps
        if self._stepped is None:
            self._link.end_held()  # it was refused, and would be again

    def _show(self) -> None:
        """Send the view if it differs from the last one, at most ten times a second."""
        now_s = time.monotonic()
        since_s = now_s - self._sent_s
        if self._sent is not None and since_s < _AT_LEAST_S:
            return
        if not self._changed and now_s - self._looked_s < _AT_LEAST_S:
            return
        self._changed, self._looked_s = False, now_s
        view = view_of(self._state, now_s)
        if self._sent is not None and _ageless(view) == _ageless(self._sent):
            ages = view.status is not None and since_s >= _AGE_S
            if not ages:
                return
        self._sent, self._sent_s = view, now_s
        for _ in range(_MOST_CUTS):
            if self._link.send({"t": "view", "view": to_wire(view)}) or self._link.left:
                return
            view = _shorter(view)


def _ageless(view: View) -> View:
    return view if view.status is None else replace(view, status=replace(view.status, age_s=0.0))


def _shorter(view: View) -> View:
    """Return a view with fewer of its sentences; each time that it is too long for a line."""
    body = view.body
    if len(view.heard) > 1:
        return replace(view, heard=_half(view.heard))
    match body:
        case EndView(lines=lines):
            return replace(view, body=replace(body, lines=_half(lines)))
        case WaitView(told=told) | QuestionView(told=told):
            return replace(view, body=replace(body, told=_half(told)))
        case _:
            return replace(view, body=WaitView((tr("The rest is too long to be shown here."),)))


def _half(lines: tuple[str, ...]) -> tuple[str, ...]:
    kept = lines[: len(lines) // 2] if len(lines) > 1 else ()
    left_out = tr("The rest is too long to be shown here.")
    return (*(one for one in kept if one != left_out), left_out)


def last_screen(state: WizardState, error: BaseException | None, at_s: float) -> LastScreen:
    """Return how the work ended; on a page each end has a screen, also one that lines would tell.

    Args:
        state: The last one.
        error: What ended the work; ``None`` where it was carried out.
        at_s: When.
    """
    ended = ended_of(state, error, at_s)
    if ended is not None:
        return ended
    if error is None:
        told = (*state.fresh, *state.closing) or state.remarks
        return LastScreen(True, told, state.closing, at_s, tr("DONE"))
    if isinstance(error, RobolinkError):
        said = [one for one in (*stopped_lines(state, error), *state.closing) if one]
        blocked = is_blocked(error)
        headed = headed_of(state, error)
        kept = state.closing
        return LastScreen(
            False, tuple(said), kept, at_s, headed, again=not blocked, blocked=blocked
        )
    why = tr("You ended it.") if isinstance(error, KeyboardInterrupt) else str(error)
    return LastScreen(False, (why,), (), at_s, tr("STOPPED"), again=False)
