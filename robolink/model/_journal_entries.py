"""What is recorded about a tool: the words in which drivers and procedures report.

A value that is written may rest on an answer as much as on a touch: "is the new tip exactly as
long as the old one?" decides Z. So whatever asks, asks through a primitive that keeps the answer:
the runner of procedures, and the prompts of the command line. What was answered in advance, by an
option or ``--yes``, is kept with the question that it answered.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar, Final

from robolink.messages import tr


class EntryKind(StrEnum):
    """What an entry of the journal is about."""

    INTENT = "intent"
    WRITE = "write"
    READ_BACK = "read back"
    DONE = "done"
    NOT_APPLIED = "not applied"
    ROLLED_BACK = "rolled back"
    CONFLICT = "conflict"
    UNKNOWN = "unknown"
    REFUSED = "refused"
    CALIBRATION = "calibration"
    VERIFY = "verify"
    RECONNECT = "reconnect"
    DECISION = "decision"
    SELECTION = "selection"
    RAW = "raw statement"
    LEASE = "lease"
    STATION = "station"
    IDENTITY = "identity"
    BACKUP = "backup"
    CHECK = "check"
    CHECK_DAY = "check day"
    ACCURACY = "accuracy"
    ORDER = "order"
    RUN = "run"
    PANEL = "panel"
    JOURNAL = "journal"


PROOFS: Final = (
    EntryKind.READ_BACK,
    EntryKind.DONE,
    EntryKind.NOT_APPLIED,
    EntryKind.ROLLED_BACK,
)
"""Entries with a value read from the controller: the newest one shows a tool's value."""

NO_HISTORY: Final = (
    EntryKind.IDENTITY,
    EntryKind.RECONNECT,
    EntryKind.LEASE,
    EntryKind.CHECK,
    EntryKind.CHECK_DAY,
    EntryKind.RUN,
    EntryKind.PANEL,
    EntryKind.JOURNAL,
)
"""Kinds of entries about a controller that do not record a change."""


@dataclass(frozen=True, slots=True)
class NewEntry:
    """One new record.

    Attributes:
        kind: What it is about.
        change: Id of the tool change that it belongs to.
        operation: Id of the one command that it belongs to.
        tool: Number of the tool, ``None`` where none is meant.
        tolerance: What was allowed, in words.
        verdict: What was found, in words.
        details: Plain JSON values.
    """

    json_version: ClassVar[int] = 5
    kind: EntryKind
    change: str = ""
    operation: str = ""
    tool: int | None = None
    tolerance: str = ""
    verdict: str = ""
    details: Mapping[str, object] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class Signature:
    """Who did it and with what; the same for all entries of a run.

    Attributes:
        operator: Badge or name that the person gave; empty when none was given.
        role: The person's role in the cell file; empty where the cell names no people.
        os_user: User of the operating system.
        host: Name of this computer.
        nozzle: Id of the nozzle or needle.
        lot: Its lot.
        recipe: Name of the recipe.
        recipe_hash: SHA-256 of the recipe file.
        station: Id of the pin, gauge or camera.
        version: Version of this software.
    """

    operator: str = ""
    role: str = ""
    os_user: str = ""
    host: str = ""
    nozzle: str = ""
    lot: str = ""
    recipe: str = ""
    recipe_hash: str = ""
    station: str = ""
    version: str = ""


@dataclass(frozen=True, slots=True)
class Recorded:
    """One record.

    Attributes:
        number: Its number; consecutive from 1.
        at: Wall-clock label, ISO 8601 UTC with milliseconds. The order is that of the numbers.
        controller: Identity of the controller.
        kind: What it is about.
        change: Id of the tool change that it belongs to.
        operation: Id of the one command that it belongs to.
        tool: Number of the tool, ``None`` where none is meant.
        tolerance: What was allowed, in words.
        verdict: What was found, in words.
        details: Plain JSON values.
        signature: Who did it and with what.
        previous: Hash of the entry before, empty for the first.
        hash: SHA-256 of all other fields.
    """

    json_version: ClassVar[int] = 5
    number: int
    at: str
    controller: str
    kind: EntryKind
    change: str
    operation: str
    tool: int | None
    tolerance: str
    verdict: str
    details: Mapping[str, object] = field(hash=False)
    signature: Signature
    previous: str
    hash: str


@dataclass(frozen=True, slots=True)
class NewCheck:
    """One check of a cell, to be recorded outside the chain of entries.

    Attributes:
        controller: Identity of the controller; its address where nobody told it.
        cell: Name of the cell; empty for a URL.
        well: Whether it was checked and nothing was found.
        verdict: What was found, in words.
        details: Plain JSON values.
    """

    controller: str
    cell: str
    well: bool
    verdict: str
    details: Mapping[str, object] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class RecordedCheck:
    """One check on record.

    Attributes:
        number: Its number, which gives the order; consecutive from 1.
        at: Wall-clock label, ISO 8601 UTC with milliseconds.
        controller: Identity of the controller; its address where nobody told it.
        cell: Name of the cell; empty for a URL.
        well: Whether it was checked and nothing was found.
        verdict: What was found, in words.
        details: Plain JSON values.
        signature: Who checked it, and with what.
        hash: SHA-256 of all other fields.
    """

    number: int
    at: str
    controller: str
    cell: str
    well: bool
    verdict: str
    details: Mapping[str, object] = field(hash=False)
    signature: Signature
    hash: str


class AnsweredBy(StrEnum):
    """How a question was answered."""

    PERSON = "person"
    """A person typed it or pressed a key when asked."""

    STAND_IN = "stand-in"
    """The simulated person of a simulator answered; nobody was asked."""

    YES = "--yes"
    """Given with the command, for every question that a yes answers."""

    OPTION = "option"
    """Given with the command, by an option for this question."""

    RECIPE = "recipe"
    """Given by a key of the recipe."""

    COMMAND = "command"
    """The command itself is the consent: there was nobody to ask."""

    PROGRAM = "program"
    """Given by the program that uses robolink."""


def answer_entry(
    question: str,
    answer: bool | str,
    by: AnsweredBy,
    *,
    tool: int | None = None,
    **details: object,
) -> NewEntry:
    """Return the record of an answer.

    Args:
        question: What was asked, as it was shown.
        answer: Whether it was a yes, or the word or text itself.
        by: How it was answered.
        tool: Number of the tool that it is about, ``None`` where it is about none or several.
        details: More for the record, plain JSON.

    Example:
        >>> from robolink.model import AnsweredBy, answer_entry
        >>> entry = answer_entry("Is the new tip as long?", True, AnsweredBy.PERSON, tool=1)
        >>> entry.details["answer"], entry.details["answered_by"]
        ('yes', 'person')
    """
    said = answer if isinstance(answer, str) else "yes" if answer else "no"
    verdict = answer if isinstance(answer, str) else tr("accepted") if answer else tr("declined")
    return NewEntry(
        EntryKind.DECISION,
        tool=tool,
        verdict=verdict,
        details={"question": question, "answer": said, "answered_by": str(by), **details},
    )


def answered_by_in_words(by: str) -> str:
    """Return how a question was answered, in words; an unknown value as it is."""
    words = {
        AnsweredBy.PERSON: tr("asked and answered"),
        AnsweredBy.STAND_IN: tr("answered by the simulated person"),
        AnsweredBy.YES: tr("not asked: a yes was given with the command"),
        AnsweredBy.OPTION: tr("not asked: answered by an option"),
        AnsweredBy.RECIPE: tr("not asked: answered by the recipe"),
        AnsweredBy.COMMAND: tr("not asked: the command is the consent"),
        AnsweredBy.PROGRAM: tr("not asked: answered by the program"),
    }
    return next((said for one, said in words.items() if one == by), by)


_FORMER: Final = {
    "two_pose": "two-pose",
    "n_angle": "n-angle",
    "one_touch": "one-touch",
    "z_touch": "z-touch",
    "six_point": "six-point",
    "crossed_beams": "beams",
    "up_camera": "camera",
    "camera_affine": "camera-affine",
    "board_fit": "board",
}
"""Former names of methods in records, and the present names."""


def method_name_now(written: str) -> str:
    """Return a method's present name; one that never changed is returned as it is."""
    return _FORMER.get(written, written)


def with_method_name_now(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return the details of an entry, with the method's present name."""
    written = details.get("method")
    now = {"method": method_name_now(written)} if isinstance(written, str) else {}
    return {**details, **now}


def finding_named_now(how: str) -> str:
    """Return how a station was found, "METHOD with tool N", with the method's present name."""
    method, blank, rest = how.partition(" ")
    return f"{method_name_now(method)}{blank}{rest}"
