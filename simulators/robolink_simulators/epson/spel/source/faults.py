"""What is wrong with a program's text, and where."""

from collections.abc import Iterable
from dataclasses import dataclass

from robolink.errors import ConfigError
from robolink.messages import tr


@dataclass(frozen=True, slots=True)
class SourcePlace:
    """A line of a file, counted from 1."""

    file: str
    line: int


class ProgramFault(Exception):
    """One fault.

    Attributes:
        place: The line it is in.
        column: Counted from 1, 0 where the whole line is meant. In a line with macros, of the
            line as they made it.
        text: What is wrong, without the place.
        expected: What could have stood there instead.
    """

    def __init__(
        self, place: SourcePlace, text: str, *, column: int = 0, expected: tuple[str, ...] = ()
    ) -> None:
        super().__init__(text)
        self.place = place
        self.column = column
        self.text = text
        self.expected = expected

    def __str__(self) -> str:
        where = f"{self.place.file}:{self.place.line}"
        if self.column:
            where += f":{self.column}"
        if not self.expected:
            return f"{where}: {self.text}"
        wanted = tr("expected {words}", words=", ".join(self.expected))
        return f"{where}: {self.text} ({wanted})"


class ProgramRefused(ConfigError):
    """A project that cannot be built.

    Attributes:
        faults: All that is wrong with it, at least one, in the order of the lines.
    """

    def __init__(self, faults: Iterable[ProgramFault]) -> None:
        self.faults = tuple(faults)
        super().__init__(
            tr(
                "The program cannot be built. Faults: {count}. The first is {fault}.",
                count=len(self.faults),
                fault=self.faults[0],
            ),
            remedy=tr("Correct the line that is named."),
        )
