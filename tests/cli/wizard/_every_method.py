"""A whole change through the wizard's flow, by every method that moves, with interruptions.

The work runs in its own thread on a simulated cell in virtual time, and asks at a desk; here its
questions go through the flow, and a simulated person's answers come back as keys and lines. There
is no terminal: the program checks the screens.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import click
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.prompts.operator import AssistedOperator
from robolink_cli.session.check_before_start import check_before_start
from robolink_cli.wizard.ending import ended_of
from robolink_cli.wizard.faces.lines import carry_out
from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.glance import ControllerGlance
from robolink_cli.wizard.happenings import (
    Happening,
    HasEnded,
    KeyPressed,
    LineTyped,
    TooFast,
    WaitsForAnswer,
)
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.screens.sentences import told_before, told_question
from robolink_cli.wizard.state import CheckSubject, Header, Mark, WizardState
from robolink_cli.wizard.work import Desk, Work
from robolink_simulators.control.assist import InProcessEyes
from wcwidth import wcswidth

import robolink
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan, WriteSubject
from robolink.model import ControllerState, ToolOffset
from robolink.runner import FitSubject, MoveSubject
from tests.contract.test_calibrate_pivot import QUICK
from tests.contract.test_proof_after_a_break import CASES

TOOL = 1
HEADER = Header("line3", "Change needle", command="robolink -c line3 change a.toml")

ABORTS = ("check", "touch", "second touch", "moving", "write", "turn test")
"""The moments at which a change is interrupted."""

NEVER_TOUCHED = ("camera", "camera-affine", "runout-table", "board", "beams", "z-touch")
"""Methods without touches by a person."""

LONGEST_S = 60.0


def moments_of(method: str) -> tuple[str, ...]:
    """Return the moments of :data:`ABORTS` that occur in a change by a method."""
    touched = ("touch", "second touch", "turn test")
    if method in NEVER_TOUCHED:
        return tuple(one for one in ABORTS if one not in touched)
    return tuple(one for one in ABORTS if (method, one) != ("one-touch", "second touch"))


@dataclass
class FlowHand:
    """Goes through a change at the screens or lines, as a hand does.

    Attributes:
        cell: The simulated cell.
        desk: The desk at which the work asks.
        lines: Whether it types lines instead of pressing keys.
        break_at: The moment at which it does something else.
        breaks: The other action.
        broken: Whether it has done that.
        seen: The moments so far, in order.
        state: The state from which the screens are drawn.
        sent: The number of answers or commands sent.
        error: The error that ended the work.
    """

    cell: Any
    desk: Desk
    lines: bool
    break_at: str = ""
    breaks: Callable[["FlowHand"], None] = lambda _hand: None
    broken: bool = False
    seen: list[str] = field(default_factory=list)
    state: WizardState = field(default_factory=lambda: WizardState(HEADER))
    sent: int = 0
    error: BaseException | None = None

    def __post_init__(self) -> None:
        eyes = InProcessEyes(self.cell.simulator)
        self.person = AssistedOperator.with_eyes(
            eyes, lambda _text: None, way_mm=12.0, clock=self.cell.clock
        )
        self.asked = 0

    def happens(self, happening: Happening) -> None:
        self.state, effects = advance(self.state, happening)
        self.sent += len(effects)
        carry_out(self.desk, effects)
        look_at(self.state)

    def press(self, *names: str) -> None:
        for name in names:
            at_s = time.monotonic() + 0.35
            self.happens(KeyPressed(name, name if len(name) == 1 else "", at_s))

    def type(self, line: str) -> None:
        self.happens(LineTyped(line, time.monotonic() + 0.35))

    def idle(self) -> None:
        """Send input that never answers a question: ENTER, blanks, a scanner."""
        before = self.sent
        self.happens(TooFast())
        if self.lines:
            self.type("")
            self.type("   ")
        else:
            self.press("enter", "enter")
        assert self.sent == before, (self.state.question, self.state.subject)

    def take_in(self) -> None:
        """Handle the events so far, and answer the open question."""
        for one in self.desk.happened():
            self.happens(one)
            if isinstance(one, WaitsForAnswer):
                self.answer()
            elif isinstance(self.state.subject, MoveSubject) and self.state.question is None:
                self.meet("moving")
            elif self.broken and self.has_to_do():
                self.press("stop")

    def has_to_do(self) -> bool:
        """Return whether the list already says that something must be done first."""
        subject = self.state.subject
        if self.state.ending or not isinstance(subject, CheckSubject):
            return False
        return any(point.mark is Mark.TO_DO for point in subject.points)

    def meet(self, moment: str) -> bool:
        """Note a moment; return whether it is the one for the other action."""
        self.seen.append(moment)
        if moment != self.break_at or self.broken:
            return self.broken
        self.broken = True
        self.breaks(self)
        return True

    def answer(self) -> None:
        state, question = self.state, self.state.question
        assert question is not None
        self.cell.clock.sleep(0.5)
        if question.number != self.asked:
            self.asked = question.number
            if self.meet(self.moment()):
                return
            self.idle()
            if state.at_place:
                self.person.ask(question.text, question.kind)
        if self.broken:
            return
        if state.at_place:
            self.at_place()
        elif isinstance(state.subject, CheckSubject):
            self.say(["2", "5"] * 3, ["1", "2", "y"])
        elif isinstance(state.subject, WriteSubject):
            self.say(["1", "*"], ["1"])
        elif isinstance(state.subject, FitSubject):
            self.say(["5"], ["n"])
        else:
            self.say(["2", "5"], ["y"])

    def moment(self) -> str:
        state = self.state
        if state.touch is not None and state.touch.number:
            if state.touch.proof:
                return "turn test"
            return "touch" if state.touch.number == 1 else "second touch"
        if isinstance(state.subject, CheckSubject):
            return "check"
        return "write" if isinstance(state.subject, WriteSubject) else "other"

    def at_place(self) -> None:
        """Type the steps of a person who sees the tip; accept by a key or a word."""
        word = None
        while word is None:
            word = self.person.poll(0.05)
        if word not in ("done", ""):
            self.type(word)
        elif self.lines:
            self.type("\u8bb0\u5f55")
        else:
            self.press("5")

    def say(self, keys: list[str], lines: list[str]) -> None:
        if self.lines:
            for line in lines:
                self.type(line)
        else:
            self.press(*keys)


def look_at(state: WizardState) -> None:
    """Check a screen: it fits a terminal and names a way out."""
    screen = screen_of(state, time.monotonic())
    rows = screen.rows()
    assert len(rows) <= 24
    assert max(map(wcswidth, rows)) <= 80, rows
    assert screen.actions
    told_before(state)
    told_question(state)


@contextmanager
def changing(method: str, *, lines: bool, **breaks: Any) -> Iterator[tuple[FlowHand, Any]]:
    """Carry out a change by a method; yield the hand and the cell after its end."""
    case = CASES[method]
    with case.cell() as cell:
        desk = Desk()
        hand = FlowHand(cell, desk, lines, **breaks)
        with click.Context(click.Command("change")), sitting_at(desk):
            work = Work(lambda: whole_change(cell, case, desk))
            work.start()
            end_s = time.monotonic() + LONGEST_S
            while not work.ended:
                hand.take_in()
                work.wait(0.001)
                assert time.monotonic() < end_s, (hand.state.question, hand.seen[-3:])
            hand.take_in()
        hand.error = work.error
        last = ended_of(hand.state, work.error, time.monotonic())
        if last is not None:
            hand.happens(HasEnded(last))
        yield hand, cell


def whole_change(cell: Any, case: Any, desk: Desk) -> None:
    """Do what the command does from the check list on."""
    with robolink.connect(cell.url) as controller:
        desk.glance = ControllerGlance(controller).at_rest
        tool = ToolPlan(TOOL, case.source(cell), approach=case.approach)
        if controller.capabilities.motors:
            controller.motors(True)
        check_before_start(
            controller, "to measure", moves=9, speed_mm_s=20.0, box_mm=100.0, at=None
        )
        change = NozzleChange(controller, ChangePlan((tool,), QUICK), operator=desk)
        desk.regard(change.run())


def stored(cell: Any) -> ToolOffset | None:
    """Return the stored offset, read by a separate connection."""
    cell.simulator.panel.release_estop()
    with robolink.connect(cell.url) as controller:
        if controller.status().state is not ControllerState.READY:
            controller.reset_fault()
        return controller.tools.read(TOOL)
