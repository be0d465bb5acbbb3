"""One line of ``doctor``, and a look that may break off without ending the others."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from robolink.messages import declared, tr

FoundT = TypeVar("FoundT")


class Level(StrEnum):
    """How bad it is; only BAD keeps robolink from working."""

    OK = declared("ok")
    WARN = declared("warn")
    BAD = declared("bad")


@dataclass(frozen=True, slots=True)
class Remark:
    """What was looked at and found.

    Attributes:
        subject: Short name of what was looked at; the same in every language.
        level: How bad it is.
        what: What was found.
        remedy: What to do; empty when nothing has to be done.
    """

    subject: str
    level: Level
    what: str
    remedy: str = ""


def guarded(subject: str, look: Callable[[], Iterable[Remark]]) -> Iterator[Remark]:
    """Yield what a look finds; if it breaks off, one more remark says why.

    A driver, a keyring service or a package's metadata may fail in any way of its own, and whoever
    runs ``doctor`` needs the other looks then more than ever.

    Args:
        subject: Short name of what is looked at.
        look: Finds it out.
    """
    try:
        yield from look()
    except Exception as error:
        yield Remark(
            subject,
            Level.WARN,
            tr("this could not be looked at ({error}).", error=failure(error)),
            tr("The other lines still count."),
        )


def tried(
    look: Callable[[], FoundT], problem: Callable[[str], str], problems: list[str]
) -> FoundT | None:
    """Return what a look finds, ``None`` if it breaks off.

    Args:
        look: Finds it out.
        problem: Makes the sentence for why it did not.
        problems: Takes that sentence.
    """
    try:
        return look()
    except Exception as error:
        problems.append(problem(failure(error)))
        return None


def failure(error: Exception) -> str:
    """Return what a failed look ended with, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).rstrip(":")
