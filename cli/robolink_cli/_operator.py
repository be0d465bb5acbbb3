"""The person at the terminal, and the simulator's stand-in for one."""

import queue
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.runner import Operator, Question
from robolink_cli._render import note


class TerminalOperator:
    """Asks on the terminal, with a prompt that can be polled.

    Lines are read by a thread of its own, so that the caller can look after the controller
    while the person takes their time; ``input()`` could not be left.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader: threading.Thread | None = None

    def tell(self, text: str) -> None:
        """Show a line."""
        self._show(text)

    def ask(self, question: str, kind: Question) -> None:
        """Show what is wanted and how to answer."""
        if kind is Question.PLACE:
            how = tr("steps like x+0.1 z-0.5; ENTER when it is on the pin; q ends")
        elif kind is Question.TEXT:
            how = tr("type it, then ENTER; q ends")
        else:
            how = tr("y or n")
        self._show(f"{question} [{how}]")
        if self._reader is None:
            self._reader = threading.Thread(target=self._read, name="prompt", daemon=True)
            self._reader.start()

    def poll(self, wait_s: float) -> str | None:
        """Return the next line; the end of input counts as a no.

        Raises:
            DeclinedError: There is nobody to answer.
        """
        try:
            line = self._lines.get(timeout=wait_s)
        except queue.Empty:
            return None
        if line is None:
            raise DeclinedError(
                tr("The input ended before the question was answered."),
                remedy=tr("Run it on a terminal, or with --assist on a simulator."),
            )
        return line

    def _read(self) -> None:
        try:
            for line in sys.stdin:
                self._lines.put(line)
        finally:
            self._lines.put(None)


@cache
def terminal() -> TerminalOperator:
    """Return the one operator of this process's terminal: two would share the input badly."""
    return TerminalOperator(note)


class AssistedOperator:
    """Stands in for the person on a simulator: looks at the tip and types jog steps.

    Args:
        look: Returns the vector, in mm, that the simulated person sees from the tip to the
            pin.
        show: Where to echo questions and answers.
        max_step_mm: Largest step it types at once.
        satisfied_mm: Content when less than this is seen on each axis; an eye that reads
            with an error would otherwise jog for ever.
    """

    def __init__(
        self,
        look: Callable[[], tuple[float, float, float]],
        show: Callable[[str], None],
        *,
        max_step_mm: float = 5.0,
        satisfied_mm: float = 0.02,
    ) -> None:
        self._look = look
        self._show = show
        self._max_step_mm = max_step_mm
        self._satisfied_mm = satisfied_mm
        self._kind = Question.PLACE

    def tell(self, text: str) -> None:
        """Echo a line."""
        self._show(text)

    def ask(self, question: str, kind: Question) -> None:
        """Echo the question."""
        self._kind = kind
        self._show(question)

    def poll(self, wait_s: float) -> str | None:  # noqa: ARG002 - it answers at once
        """Answer: the jog steps still needed, or done."""
        if self._kind is Question.YES_NO:
            return "y"
        if self._kind is Question.TEXT:
            return tr("simulated")
        # Sideways first, down last, as one does with a needle.
        dx_mm, dy_mm, dz_mm = self._look()
        aside = {"x": dx_mm, "y": dy_mm}
        steps = self._steps(aside) or self._steps({"z": dz_mm})
        self._show(tr("  operator: {answer}", answer=steps or tr("on the pin")))
        return steps or "done"

    def _steps(self, wanted: dict[str, float]) -> str:
        if all(abs(distance_mm) < self._satisfied_mm for distance_mm in wanted.values()):
            return ""
        limit = self._max_step_mm
        steps = {axis: max(-limit, min(limit, mm)) for axis, mm in wanted.items()}
        return " ".join(f"{axis}{step:+.3f}" for axis, step in steps.items())


@contextmanager
def operator_at(assist_url: str | None, tool: Callable[[], int]) -> Iterator[Operator]:
    """Yield the person at the terminal, or a simulator's stand-in for one.

    Args:
        assist_url: The simulator's assist URL, ``None`` for a real person.
        tool: Tells which tip the stand-in is to look at.
    """
    if assist_url is None:
        yield terminal()
        return
    from robolink_simulators.assist import open_eyes

    with open_eyes(assist_url) as eyes:

        def look() -> tuple[float, float, float]:
            seen = eyes.look(tool())
            return seen.dx_mm, seen.dy_mm, seen.dz_mm

        yield AssistedOperator(look, note)
