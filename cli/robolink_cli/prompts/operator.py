"""The person at the terminal, and the simulator's substitute for one."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Final

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy
from robolink.runner import FINEST_STEP, Operator, Question, parse_steps
from robolink_cli.console.render import note
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.lines import QUIET_S, Lines, open_lines

if TYPE_CHECKING:
    from robolink_simulators.cell.habits import PersonManner
    from robolink_simulators.cell.places import Axis, XyzMm
    from robolink_simulators.control.assist import AssistClient, InProcessEyes

    from robolink.timing import Clock

WAY_MM: Final = 60.0
"""Distance in mm that the simulated operator jogs to show an axis."""

_PLACES: Final = frozenset({Question.PLACE, Question.ROOM, Question.ALONG_X, Question.ALONG_Z})

MOST_STEPS: Final = 300
"""Most answers to one question, enough for 1.5 m of jogging. Then the simulated operator gives up.
"""


class TerminalOperator:
    """Asks on the terminal, with a prompt that can be polled.

    The caller can look after the controller while the person takes their time; ``input()`` could
    not be left. What was typed before something was shown is no answer to it: see
    :mod:`robolink_cli.prompts.lines`.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self._lines: Lines | None = None
        self._kind = Question.PLACE

    def tell(self, text: str) -> None:
        """Show a line."""
        if self._lines is not None:
            self._forget(0.0)
        self._show(text)

    def ask(self, question: str, kind: Question) -> None:
        """Show what is wanted and how to answer."""
        if self._lines is None:
            self._lines = open_lines()
        self._kind = kind
        self._forget(QUIET_S)
        self._show(f"{question} [{_how(kind)}]")

    def poll(self, wait_s: float) -> str | None:
        """Return the next line; the end of input counts as a no.

        Raises:
            DeclinedError: There is nobody to answer.
        """
        assert self._lines is not None  # noqa: S101 - a question is shown before it is answered
        try:
            line = self._lines.next(wait_s)
        except EOFError as error:
            raise DeclinedError(
                tr("The keyboard is gone. Nothing was answered for you."),
                remedy=tr("Run it on a terminal, or with --assist on a simulator."),
            ) from error
        if line is None or line.strip() or self._kind not in _PLACES:
            return line
        # Scanners send ENTER, and people press it by mistake: it records no position.
        self._show(tr("ENTER alone does nothing. When it is there: done."))
        return None

    def _forget(self, quiet_s: float) -> None:
        assert self._lines is not None  # noqa: S101 - checked by the caller
        for line in self._lines.forget(quiet_s):
            if line.strip():
                self._show(tr("Typed too early and ignored: {line!r}", line=line))


def _how(kind: Question) -> str:
    """Return how a question is answered."""
    if kind is Question.TEXT:
        return tr("Type or scan it, then Enter. To end: q.")
    if kind is Question.YES_NO:
        return tr("y or n")
    if kind is Question.CHOICE:
        return tr("Number of a row, then Enter. Enter alone: 1.")
    return tr("Steps: x+0.1 z-0.5. When it is there: done. To end: q.")


def terminal() -> Operator:
    """Return the one operator of this process's terminal: two would share the input badly.

    While a wizard shows it, that is the one whom the wizard asks.
    """
    return current_desk() or _plain_terminal()


@cache
def _plain_terminal() -> TerminalOperator:
    return TerminalOperator(note)


class AssistedOperator:
    """Replaces the person on a simulator: looks at the tip and types jog steps.

    The one simulated person of demonstration, tests and ``--assist``; :meth:`with_eyes` makes it.
    Their habits are parameters of the simulated world (docs/reference/simulated-cell.md 2).

    Args:
        look: Returns the vector, in mm, that the simulated person sees from the tip to the
            pin.
        show: Where to echo questions and answers.
        way: Returns the vector, in mm, along an axis of the tool as the simulated person sees it;
            without it they know of none, and jog nowhere to show one.
        manner: Returns how they take a question, given whether it asks for a touch; without it
            they have no habits and do not think.
        clock: By which they think.
        max_step_mm: Largest step it types at once.
        satisfied_mm: Content when less than this is seen on each axis; an eye that reads
            with an error would otherwise jog for ever.
    """

    answers_as = AnsweredBy.STAND_IN

    def __init__(
        self,
        look: "Callable[[], XyzMm]",
        show: Callable[[str], None],
        *,
        way: "Callable[[Axis], XyzMm]" = lambda _axis: (0.0, 0.0, 0.0),
        manner: "Callable[[bool], PersonManner] | None" = None,
        clock: "Clock | None" = None,
        max_step_mm: float = 5.0,
        satisfied_mm: float = 0.02,
    ) -> None:
        self._look = look
        self._show = show
        self._way = way
        self._manner = manner
        self._clock = clock
        self._max_step_mm = max_step_mm
        self._satisfied_mm = satisfied_mm
        self._kind = Question.PLACE
        self._ahead: list[str] = []
        self._answers = 0
        self._stays = False
        self._coarse = False
        self._thinking_s = 0.0

    @classmethod
    def with_eyes(
        cls,
        eyes: "AssistClient | InProcessEyes",
        show: Callable[[str], None],
        *,
        tool: Callable[[], int] = lambda: 1,
        clock: "Clock | None" = None,
        way_mm: float = WAY_MM,
    ) -> "AssistedOperator":
        """Return the person of a simulated cell, with the habits in its world.

        Args:
            eyes: Theirs.
            show: Where to echo questions and answers.
            tool: Tells which tip they are to look at.
            clock: By which they think, that of the controller; without one they do not.
            way_mm: How far they jog to show an axis.
        """

        def look() -> "XyzMm":
            seen = eyes.look(tool())
            return seen.dx_mm, seen.dy_mm, seen.dz_mm

        return cls(
            look,
            show,
            way=lambda axis: eyes.way_along(axis, way_mm, tool()),
            manner=lambda touch: eyes.be_asked(touch=touch, tool=tool()),
            clock=clock,
        )

    def tell(self, text: str) -> None:
        """Echo a line."""
        self._show(text)

    def ask(self, question: str, kind: Question) -> None:
        """Echo the question, and handle it in this person's way."""
        self._kind = kind
        self._answers = 0
        self._stays, self._thinking_s, turns = False, 0.0, list[str]()
        self._coarse = False
        if self._manner is not None:
            manner = self._manner(kind is Question.PLACE)
            self._stays, self._thinking_s = manner.stays, manner.thinks_s
            turns = [f"u{manner.turn_deg:+.3f}"] if manner.turn_deg else []
        self._ahead = [*turns, *self._steps_along(kind)]
        self._show(question)

    def poll(self, wait_s: float) -> str | None:
        """Answer: the jog steps still needed, or done; ``None`` while the person thinks.

        Raises:
            DeclinedError: It has answered this question so often that it will never get there.
        """
        if self._thinks(wait_s):
            return None
        self._answers += 1
        if self._answers > MOST_STEPS:
            raise DeclinedError(
                tr(
                    "The simulated operator did not reach the pin in {count} steps.",
                    count=MOST_STEPS,
                ),
                remedy=tr("To see where pin and tip are: robolink sim assist URL truth"),
            )
        if self._kind is Question.YES_NO:
            return "y"
        if self._kind is Question.CHOICE:
            return "1"  # the simulated operator makes no decisions
        if self._kind is Question.TEXT:
            return tr("simulated")
        if self._stays:
            self._show(tr("  operator: presses Enter without looking"))
            return ""
        steps, arrived = self._ahead.pop(0) if self._ahead else "", tr("there")
        if self._kind is Question.PLACE:
            steps, arrived = steps or self._steps_to_pin(), tr("on the pin")
        self._show(tr("  operator: {answer}", answer=steps or arrived))
        deltas = parse_steps(steps).values() if steps else ()
        self._coarse = any(abs(by) > FINEST_STEP for by in deltas)
        return steps or "done"

    def _thinks(self, wait_s: float) -> bool:
        """Let the person think, for ``wait_s`` at most; return whether they think on."""
        if self._clock is None:
            return False
        pause_s = min(wait_s, self._thinking_s)
        self._clock.sleep(pause_s)
        self._thinking_s -= pause_s
        return self._thinking_s > 0

    def _steps_to_pin(self) -> str:
        # The last step is small and straight down, as a person would do it with a needle.
        dx_mm, dy_mm, dz_mm = self._look()
        far = abs(dz_mm) > FINEST_STEP
        first_mm = (dz_mm + FINEST_STEP if dz_mm < 0.0 else dz_mm) if far else 0.0
        steps = self._steps({"x": dx_mm, "y": dy_mm, "z": first_mm}) or self._steps(
            {"z": max(-FINEST_STEP, min(FINEST_STEP, dz_mm))}
        )
        # After a long step, go back by a fine one and approach again.
        return steps or (f"z{FINEST_STEP:+.3f}" if self._coarse else "")

    def _steps_along(self, kind: Question) -> Iterator[str]:
        """Yield the steps of a move along an axis, or up to where both moves have room."""
        if kind is Question.ROOM:
            lowest_mm = min(self._way("x")[2], self._way("z")[2])
            way_mm = (0.0, 0.0, max(0.0, -lowest_mm))
        elif kind is Question.ALONG_X:
            way_mm = self._way("x")
        elif kind is Question.ALONG_Z:
            way_mm = self._way("z")
        else:
            return
        pieces = math.ceil(max(map(abs, way_mm)) / self._max_step_mm)
        gone = [0.0, 0.0, 0.0]
        for piece in range(1, pieces + 1):
            # The next step corrects the rounding of this one.
            step = [round(mm * piece / pieces - at, 3) for mm, at in zip(way_mm, gone, strict=True)]
            gone = [at + by for at, by in zip(gone, step, strict=True)]
            yield " ".join(f"{axis}{by:+.3f}" for axis, by in zip("xyz", step, strict=True))

    def _steps(self, wanted: dict[str, float]) -> str:
        if all(abs(distance_mm) < self._satisfied_mm for distance_mm in wanted.values()):
            return ""
        limit = self._max_step_mm
        steps = {axis: max(-limit, min(limit, mm)) for axis, mm in wanted.items()}
        return " ".join(f"{axis}{step:+.3f}" for axis, step in steps.items())


@contextmanager
def operator_at(
    assist_url: str | None, tool: Callable[[], int], clock: "Clock"
) -> Iterator[Operator]:
    """Yield the person at the terminal, or a simulator's substitute for one.

    Args:
        assist_url: The simulator's assist URL, ``None`` for a real person.
        tool: Tells which tip the stand-in is to look at.
        clock: The controller's, by which the stand-in thinks.
    """
    if assist_url is None:
        yield terminal()
        return
    from robolink_simulators.control.assist import open_eyes

    with open_eyes(assist_url) as eyes:
        yield AssistedOperator.with_eyes(eyes, note, tool=tool, clock=clock)
