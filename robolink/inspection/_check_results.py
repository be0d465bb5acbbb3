"""What the check of a cell found, or what kept it from being checked."""

from dataclasses import dataclass, field
from enum import StrEnum

from robolink.errors import BusyError, RobolinkError
from robolink.inspection._inspection import Inspection
from robolink.messages import tr
from robolink.model import NewCheck


class CheckState(StrEnum):
    """How the check of a cell ended."""

    WELL = "well"
    ATTENTION = "attention"
    BUSY = "busy"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class CheckFailure:
    """Why a cell was not checked, or not to the end.

    Attributes:
        kind: Class of the error in :mod:`robolink.errors`.
        what: What happened.
        remedy: What to do; empty where that says it.
        busy: Whether somebody works at the cell, so that it is to be checked later.
    """

    kind: str
    what: str
    remedy: str = ""
    busy: bool = False

    @classmethod
    def of(cls, error: RobolinkError) -> "CheckFailure":
        """Return what an error says."""
        busy = isinstance(error, BusyError)
        kind = next(
            one for one in type(error).__mro__ if one.__module__ == RobolinkError.__module__
        )
        return cls(kind.__name__, error.what, error.remedy, busy)


@dataclass(frozen=True, slots=True)
class CellCheck:
    """The check of one cell.

    Attributes:
        cell: Its name, or its URL where it has none.
        inspection: What was found; ``None`` where nothing could be looked at.
        failure: Why it was not checked, or not to the end; ``None`` where it was.
        seconds: How long it took.
    """

    cell: str
    inspection: Inspection | None
    failure: CheckFailure | None
    seconds: float = field(compare=False)

    @property
    def state(self) -> CheckState:
        """How it ended."""
        if self.failure is not None:
            return CheckState.BUSY if self.failure.busy else CheckState.FAILED
        found = self.inspection
        return CheckState.WELL if found and not found.findings else CheckState.ATTENTION

    @property
    def well(self) -> bool:
        """Whether it was checked and needs no attention."""
        return self.state is CheckState.WELL

    def new_record(self, controller: str, name: str) -> NewCheck:
        """Return it for the record.

        Args:
            controller: Identity of the controller.
            name: Of the cell; empty where it has none.
        """
        failure, found = self.failure, self.inspection
        details = {} if found is None else found.details
        verdict = "" if found is None else found.verdict
        if failure is not None:
            verdict = tr("The cell could not be checked: {what}", what=failure.what)
            details["error"] = failure.kind
        details["elapsed_s"] = round(self.seconds, 3)
        return NewCheck(controller, name, self.well, verdict, details)
