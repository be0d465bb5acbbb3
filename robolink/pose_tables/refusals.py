"""Why a file of poses is refused: broken at a line, not finite, or silent about something."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from robolink.errors import AmbiguousPosesError, CalibrationError, ConfigError
from robolink.messages import joined, tr


class UnusableText(Exception):
    """A text is no table of poses.

    Attributes:
        why: The reason, the second half of a sentence.
        line: Where, from 1; 0 when it is about the whole.
        pose: The same for what has no lines of its own: the number of the pose, from 1.
    """

    def __init__(self, why: str, line: int = 0, pose: int = 0) -> None:
        super().__init__(why)
        self.why = why
        self.line = line
        self.pose = pose


@contextmanager
def at_line(line: int) -> Iterator[None]:
    """Name the line of a refusal from inside the block that names none itself."""
    try:
        yield
    except UnusableText as cause:
        cause.line = cause.line or (0 if cause.pose else line)
        raise


@contextmanager
def at_pose(number: int) -> Iterator[None]:
    """Name the number of the pose of a refusal from inside the block that names no place."""
    try:
        yield
    except UnusableText as cause:
        cause.pose = cause.pose or (0 if cause.line else number)
        raise


class NotFiniteText(UnusableText):
    """Where a finite number belongs there is something else."""

    def __init__(self, name: str, value: object, line: int = 0) -> None:
        super().__init__(tr("{name} is {value!r}", name=name, value=value), line)


@dataclass(frozen=True, slots=True)
class OpenQuestion:
    """Something that a file does not say.

    Attributes:
        about: ``columns``, ``length`` or ``euler``.
        what: What is not said, the second half of a sentence.
        remedy: How to say it, with the readings there are.
    """

    about: str
    what: str
    remedy: str


class UnclearText(Exception):
    """A text can be read in more than one way."""

    def __init__(self, *questions: OpenQuestion) -> None:
        super().__init__(*questions)
        self.questions = questions


def refused(path: Path, cause: UnusableText) -> ConfigError | CalibrationError:
    """Return the error for a file that cannot be used: ``non_finite`` by that name."""
    why = cause.why
    if cause.line:
        why = tr("line {line}: {why}", line=cause.line, why=why)
    elif cause.pose:
        why = tr("pose {number}: {why}", number=cause.pose, why=why)
    what = tr("{path} cannot be used: {why}.", path=path, why=why)
    remedy = tr("Nothing was sent. Correct the file or name another one.")
    if isinstance(cause, NotFiniteText):
        return CalibrationError("non_finite", what, remedy=remedy)
    return ConfigError(what, remedy=remedy)


def unclear(path: Path, questions: Sequence[OpenQuestion]) -> AmbiguousPosesError:
    """Return the error for a file that leaves something open."""
    whats = joined("; ", (question.what for question in questions))
    return AmbiguousPosesError(
        tr("{path} does not say everything: {what}.", path=path, what=whats),
        asks=tuple(question.about for question in questions),
        remedy=joined(" ", (question.remedy for question in questions)),
    )
