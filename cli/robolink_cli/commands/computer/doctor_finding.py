"""One line of ``doctor``."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How bad it is; only BAD keeps robolink from working."""

    OK = "ok"
    WARN = "warn"
    BAD = "bad"


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
