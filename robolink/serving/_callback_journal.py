"""A program's change in the journal: open from before it may write to its end.

Source: docs/reference/rules.md 6, with the program in the place of the driver. The marker is the
one of any tool change, so ``robolink recover`` settles it where the controller can be read.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import (
    EntryKind,
    Marker,
    MarkerKind,
    NewEntry,
    ToolOffset,
    new_operation,
    plain_offset,
    read_offset,
)
from robolink.protocols.spel_callback import same_thousandths
from robolink.timing import wall_label

if TYPE_CHECKING:
    from robolink.journal import JournalOutcomeLog


CALLED_BACK: Final = "called_back"
_PROVED: Final = "proved"
_UNSET: Final = frozenset({"-", "0"})


class ProgramChange:
    """One change that a program was given a value for.

    Attributes:
        operation: Its id, which the program keeps with the old value.
        tool: The tool.
        before: What it held.
        requested: What it is to hold.
        proved: Whether its proof has passed, so that it may be kept.
    """

    def __init__(self, log: "JournalOutcomeLog", marker: Marker) -> None:
        ((number, values),) = _tools(marker).items()
        self.operation = marker.operation
        self.tool = int(number)
        self.before = read_offset(values["before"])
        self.requested = read_offset(values["requested"])
        self.proved = marker.details.get(_PROVED) is True
        self._log = log
        self._marker = marker

    def note(self, kind: EntryKind, verdict: str, **details: object) -> None:
        """Record something about it.

        Raises:
            JournalError: It is not stored.
        """
        self._log.append(self._entry(kind, verdict, details))

    def allow_keeping(self, verdict: str, **details: object) -> None:
        """Record the turn test durably, before the program is told to keep the value.

        Raises:
            JournalError, BusyError: It is not stored, or another works on the controller.
        """
        marker = replace(self._marker, details={**self._marker.details, _PROVED: True})
        self._log.begin(marker)
        self._marker, self.proved = marker, True
        self.note(EntryKind.VERIFY, verdict, **details)

    def end_kept(self, value: ToolOffset | None) -> bool:
        """Close it as kept; return false, and record a conflict, if that is impossible."""
        if self.proved and same_thousandths(value, self.requested):
            self._close(EntryKind.DONE, tr("tested, and kept by the program"), value)
            return True
        return self._conflict(value)

    def end_restored(self, value: ToolOffset | None) -> bool:
        """Close it as restored; return false, and record a conflict, if that is impossible."""
        if same_thousandths(value, self.before):
            self._close(EntryKind.ROLLED_BACK, tr("restored by the program"), value)
            return True
        return self._conflict(value)

    def end_never_written(self, value: ToolOffset | None) -> bool:
        """Close it if the program never kept it open; false if the tool is another."""
        if same_thousandths(value, self.before):
            self._close(EntryKind.NOT_APPLIED, tr("never written by the program"), value)
            return True
        return self._conflict(value)

    def _conflict(self, value: ToolOffset | None) -> bool:
        self.note(EntryKind.CONFLICT, tr("the tool holds another value"), value=plain_offset(value))
        return False

    def _close(self, kind: EntryKind, verdict: str, value: ToolOffset | None) -> None:
        entry = self._entry(kind, verdict, {"value": plain_offset(value)})
        self._log.clear(self.operation, entry)

    def _entry(self, kind: EntryKind, verdict: str, details: Mapping[str, object]) -> NewEntry:
        return NewEntry(
            kind,
            change=self.operation,
            operation=self.operation,
            tool=self.tool,
            verdict=verdict,
            details={
                "before": plain_offset(self.before),
                "requested": plain_offset(self.requested),
                CALLED_BACK: True,
                **details,
            },
        )


def record_name(serial: str, robot: int, controllers: Collection[str]) -> str:
    """Return the name under which a robot is recorded; empty if it has no number of its own.

    Args:
        serial: What RobotSerial$ gives.
        robot: Which robot of its controller it is, from 1.
        controllers: Names that a person gave. Of several robots each has its own, which ends in its
            serial number (docs/decisions/0025-each-robot-of-a-controller-has-its-record.md).

    Raises:
        CalibrationError: ``unknown_robot``: one name was given, for another robot.
    """
    for name in controllers:
        if serial not in _UNSET and name.endswith((f":{serial}", f"/{serial}")):
            return name
    if len(controllers) == 1 and robot == 1:
        return next(iter(controllers))
    if controllers:
        raise CalibrationError(
            "unknown_robot", tr("Robot {serial} was not named when this began.", serial=serial)
        )
    return "" if serial in _UNSET else f"epson:{serial}"


def begin_change(
    log: "JournalOutcomeLog", tool: int, before: ToolOffset | None, requested: ToolOffset
) -> ProgramChange:
    """Store durably that a program is about to write a tool, and take the lease.

    Raises:
        JournalError: It is not stored; the program must not get the value.
        BusyError: Another works on the controller.
    """
    operation = new_operation()
    values = {"before": plain_offset(before), "requested": plain_offset(requested)}
    details = {
        "tools": {str(tool): values},
        "tool": tool,
        "verify": True,
        "change": operation,
        CALLED_BACK: True,
    }
    request = tr("change of tool {numbers} by the program", numbers=tool)
    marker = Marker(operation, MarkerKind.CHANGE, request, wall_label(), details)
    log.begin(marker)
    return ProgramChange(log, marker)


def open_changes(log: "JournalOutcomeLog") -> tuple[list[ProgramChange], bool]:
    """Return the open changes of programs, and whether anything else is open.

    Raises:
        JournalError: The journal cannot be read.
    """
    markers = log.open_markers()
    own = [marker for marker in markers if _is_own(marker)]
    return [ProgramChange(log, marker) for marker in own], len(own) < len(markers)


def _is_own(marker: Marker) -> bool:
    called_back = marker.details.get(CALLED_BACK) is True
    return called_back and marker.kind is MarkerKind.CHANGE and len(_tools(marker)) == 1


def _tools(marker: Marker) -> Mapping[str, Mapping[str, object]]:
    tools = marker.details.get("tools")
    return tools if isinstance(tools, dict) else {}
