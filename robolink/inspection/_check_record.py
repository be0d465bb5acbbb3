"""The record of checks: each in the journal of its cell, beside the chain."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final, NamedTuple

from robolink.config import Cell, find_cell
from robolink.errors import JournalError, RobolinkError
from robolink.inspection._check_results import CellCheck, CheckFailure
from robolink.journal import (
    Journal,
    Meetings,
    default_location,
    memory_journal,
    not_at_home,
    open_journal,
    signature_here,
)
from robolink.journal.store.seal import MovedRecordError
from robolink.model import Controller, NewCheck, Signature
from robolink.transport import parse_url
from robolink.version import VERSION

_AT_A_TIME: Final = 100
"""Number of checks that are recorded in one transaction."""


class CheckPlace(NamedTuple):
    """A cell to be checked, with its place in the order."""

    number: int
    cell: Cell | str
    name: str
    url: str
    address: str

    @property
    def called(self) -> str:
        return self.name or self.url

    @property
    def inside(self) -> bool:
        """Whether its controller is a simulator in this process, which nobody else has."""
        return "+sim://" in self.url


def place_of(number: int, cell: Cell | str) -> CheckPlace:
    if isinstance(cell, str):
        if "://" in cell:
            return CheckPlace(number, cell, "", cell, parse_url(cell).address)
        cell = find_cell(cell)
    return CheckPlace(number, cell, cell.name, cell.url, parse_url(cell.url).address)


class Met(NamedTuple):
    """A controller that was connected to.

    Attributes:
        name: Under which name it is on record.
        memory: Its address, if its record ends with this process; else empty.
    """

    name: str
    memory: str = ""


def met_by(controller: Controller) -> Met:
    outcomes = controller.outcomes
    memory = "" if outcomes.durable else controller.identity
    return Met(outcomes.robot or outcomes.identity, memory)


class EndedCheck(NamedTuple):
    """A check that has ended.

    Attributes:
        place: Of which cell.
        check: The result.
        met: The controller; ``None`` where nobody told who it is.
    """

    place: CheckPlace
    check: CellCheck
    met: Met | None = None


class Recorder:
    """Keeps the checks in the order of their cells, and records them a hundred at a time.

    Args:
        places: The cells.
        signature: Who checks.
        keep_days: For how many days checks are kept; ``None`` deletes none.
        tell: Receives sentences about a cell that a person should know once.

    Attributes:
        meetings: Who was met, to be recorded with the checks.
    """

    def __init__(
        self,
        places: Sequence[CheckPlace],
        signature: Signature,
        keep_days: int | None,
        tell: Callable[[str], None] = lambda _sentence: None,
    ) -> None:
        self._places = places
        self._signature = signature
        self._keep_days = keep_days
        self._tell = tell
        self.meetings = Meetings()
        self._done: dict[int, CellCheck] = {}
        self._waiting: list[EndedCheck] = []

    @property
    def checks(self) -> tuple[CellCheck, ...]:
        """All of them."""
        return tuple(self._done[place.number] for place in self._places)

    def take(self, ended: EndedCheck) -> CellCheck:
        """Keep one, and return it."""
        self._done[ended.place.number] = ended.check
        self._waiting.append(ended)
        if len(self._waiting) >= _AT_A_TIME:
            self.store()
        return ended.check

    def store(self) -> None:
        """Record what waits for that; a check that cannot be recorded has failed."""
        remarks = [*self.meetings.record()]
        waiting, self._waiting = self._waiting, []
        groups: dict[tuple[str, str], list[EndedCheck]] = {}
        for one in waiting:
            if not_at_home(one.place.address):
                continue  # it was not checked, and its record is on another computer
            memory = one.met.memory if one.met else ""
            kept = "" if memory else default_location(one.place.address)
            groups.setdefault((memory, kept), []).append(one)
        for (memory, kept), group in groups.items():
            try:
                self._append(memory, kept, group)
            except MovedRecordError:
                for one in group:  # only the records of some cells are elsewhere
                    try:
                        self._append(memory, kept, [one])
                    except JournalError as error:
                        self._fail([one], error)
            except JournalError as error:  # nor would one alone be stored; perhaps all of them were
                self._fail(group, error)
        for called, remark in remarks:
            self._tell(f"{called}: {remark}")

    def _fail(self, group: Sequence[EndedCheck], error: JournalError) -> None:
        for one in group:
            if one.check.failure is None:
                failed = replace(one.check, failure=CheckFailure.of(error))
                self._done[one.place.number] = failed

    def _append(self, memory: str, kept: str, group: Sequence[EndedCheck]) -> None:
        journal = memory_journal(memory) if memory else open_journal(kept)
        records = [self._record(journal, one) for one in group]
        try:
            journal.record_checks(records, signature=self._signature, keep_days=self._keep_days)
        except MovedRecordError as error:
            if len(records) > 1:
                raise
            raise error.about([records[0].controller]) from error

    def _record(self, journal: Journal, ended: EndedCheck) -> NewCheck:
        controller = ended.met.name if ended.met else journal.names_of(ended.place.address)[0]
        return ended.check.new_record(controller, ended.place.name)


def record_check(
    check: CellCheck,
    cell: Cell | str,
    *,
    controller: Controller | None = None,
    signature: Signature | None = None,
    keep_days: int | None = None,
) -> CellCheck:
    """Record a check that was made elsewhere, with what it found; see :func:`check_cells`.

    Args:
        check: The check.
        cell: The cell, its name, or the URL of a controller.
        controller: Its controller, where it was reached.
        signature: Who checked; by default the user of this computer.
        keep_days: For how many days checks are kept; by default none is deleted.

    Returns:
        The same; failed where it could not be recorded.

    Raises:
        ConfigError: There is no such cell, or a cell file is wrong.

    Example:
        >>> from robolink.inspection import CellCheck, CheckFailure, record_check
        >>> failure = CheckFailure("DeclinedError", "You said no.")
        >>> check = CellCheck("epson+sim://record-check-example", None, failure, 0.1)
        >>> record_check(check, "epson+sim://record-check-example").failure.what
        'You said no.'
    """
    place = place_of(0, cell)
    recorder = Recorder([place], signature or signature_here(VERSION), keep_days)
    met = None
    if controller is not None:
        with suppress(RobolinkError):  # a link that broke before it told who it is
            met = met_by(controller)
    recorder.take(EndedCheck(place, check, met))
    recorder.store()
    return recorder.checks[0]
