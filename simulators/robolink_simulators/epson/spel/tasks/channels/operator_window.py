"""The window in which a person answers Input (docs/reference/spel.md 17)."""

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.printing import CRLF
from robolink_simulators.epson.spel.expressions.values import LONGEST_STRING

if TYPE_CHECKING:
    from robolink_simulators.epson.spel.tasks.task import SpelTask

WINDOW_NUMBERS: Final = (20, 21, 24)
"""A pendant, RC+, another pendant: one and the same window here (docs/reference/spel.md 17)."""

USUAL_WINDOW: Final = 21


class OperatorWindow:
    """Lines that a person types, in the order in which tasks ask for them.

    Args:
        show: Shows a text.

    Attributes:
        answers: What was typed and nobody has asked for yet.
        ask: Asks a person for the next line when there is none; ``None`` from it means that nobody
            will answer any more. Without it tasks wait until a line stands in ``answers``.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        self.answers: deque[str] = deque()
        self.ask: Callable[[], str | None] | None = None
        self._show = show
        self._prompted = False
        self._closed = False

    def type(self, *lines: str) -> None:
        """Type lines."""
        self.answers.extend(lines)

    def lines(self, number: int, task: "SpelTask") -> int:  # noqa: ARG002 - as a port has them
        """Return how many lines are there; if there is none, ask (documented: a ``?`` shows)."""
        if not self._prompted:
            self._show("?")
            self._prompted = True
        if not self.answers and self.ask is not None and not self._closed:
            answer = self.ask()
            if answer is None:
                self._closed = True
            else:
                self.answers.append(answer)
        return len(self.answers)

    def line(self, number: int, task: "SpelTask") -> str | None:  # noqa: ARG002 - as a port has it
        """Take a line; ``None`` while there is none.

        Raises:
            Refusal: Nobody answers any more, or it is longer than a string can be.
        """
        if not self.answers:
            if self._closed:
                raise SpelRefusal(RefusalKind.INPUT_COUNT, "Nobody answers")
            return None
        self._prompted = False
        text = self.answers.popleft()
        if len(text) > LONGEST_STRING:
            raise SpelRefusal(RefusalKind.PORT_LINE_TOO_LONG, f"A line of {len(text)} characters")
        return text

    def timeout_s(self, number: int) -> float:  # noqa: ARG002 - as a port has one
        """Return 0: a person has all the time there is."""
        return 0.0

    def connected(self, number: int) -> bool:  # noqa: ARG002 - as a port tells it
        """Tell whether somebody may answer."""
        return not self._closed

    def foreign(self, number: int, task: "SpelTask") -> bool:  # noqa: ARG002 - as a port tells it
        """Tell that the window is every task's."""
        return False

    def write(self, number: int, text: str, task: "SpelTask", *, ends: bool) -> None:  # noqa: ARG002
        """Show a text, as Print does."""
        self._show(text + (CRLF if ends else ""))

    def write_bytes(self, number: int, data: bytes, task: "SpelTask") -> None:  # noqa: ARG002
        """Refuse WriteBin.

        Raises:
            Refusal: Always.
        """
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Bytes to a window")

    def bytes(self, number: int, count: int, task: "SpelTask") -> bytes:  # noqa: ARG002
        """Refuse Read and ReadBin: the window has lines.

        Raises:
            Refusal: Always.
        """
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Bytes from a window")

    def waiting_bytes(self, number: int, task: "SpelTask") -> int:  # noqa: ARG002
        """Return 0; see :meth:`bytes`."""
        return 0

    def require_binary(self, number: int, task: "SpelTask") -> None:
        """Let the statement find out by itself; see :meth:`bytes`."""
