"""What is put on record about a tool: the words in which drivers and procedures report."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final


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
    ACCURACY = "accuracy"
    ORDER = "order"


PROOFS: Final = (
    EntryKind.READ_BACK,
    EntryKind.DONE,
    EntryKind.NOT_APPLIED,
    EntryKind.ROLLED_BACK,
)
"""Entries whose value was read from the controller: the newest tells what a tool holds."""

NO_HISTORY: Final = (
    EntryKind.IDENTITY,
    EntryKind.RECONNECT,
    EntryKind.LEASE,
    EntryKind.CHECK,
)
"""What is recorded of a controller without anything being changed on it."""


@dataclass(frozen=True, slots=True)
class NewEntry:
    """One thing to put on record.

    Attributes:
        kind: What it is about.
        change: Id of the tool change that it belongs to.
        operation: Id of the one command that it belongs to.
        tool: Number of the tool, ``None`` where none is meant.
        tolerance: What was allowed, in words.
        verdict: What was found, in words.
        details: Plain JSON values.
    """

    kind: EntryKind
    change: str = ""
    operation: str = ""
    tool: int | None = None
    tolerance: str = ""
    verdict: str = ""
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Signature:
    """Who did it and with what: the same for all entries of a run.

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
    """One thing that is on record.

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

    number: int
    at: str
    controller: str
    kind: EntryKind
    change: str
    operation: str
    tool: int | None
    tolerance: str
    verdict: str
    details: Mapping[str, object]
    signature: Signature
    previous: str
    hash: str
