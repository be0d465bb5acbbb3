"""What an end of a job means for its plan: one table of exit codes and names of errors.

A job is a robolink command, or the same as a library call, so it ends with an exit code
(docs/commands.md, "How a command ends: exit codes, and what the controller holds") and, unless that
is 0, with the name of an error. Only what says that the cell was busy, locked or not reached is
tried again: nothing was begun there. Every other end is the last one of its job, because an order
that ended declined, stopped, refused or put back must not run again by being delivered again.
"""

from enum import StrEnum
from typing import Final

from robolink.errors import NotReadyReason


class Treatment(StrEnum):
    """What becomes of a job that ended."""

    DONE = "done"
    BUSY = "busy"
    """Tried again: somebody else has the cell, or production runs."""
    OFF = "off"
    """Tried again: the cell was not reached."""
    PERSON = "person"
    """The end of this cell; a person has to look there."""
    UNSETTLED = "unsettled"
    """The end of this cell, and the plan halts."""
    HALT = "halt"
    """The end of this cell, and the plan halts: the cause is the plan, the database or robolink."""

    @property
    def again(self) -> bool:
        """Whether the job is tried again."""
        return self in (Treatment.BUSY, Treatment.OFF)


BY_CODE: Final = {
    0: Treatment.DONE,
    1: Treatment.DONE,  # it found something: that is on record, and nothing was refused
    2: Treatment.PERSON,
    3: Treatment.OFF,
    4: Treatment.PERSON,
    5: Treatment.PERSON,
    6: Treatment.UNSETTLED,
    7: Treatment.PERSON,
    8: Treatment.PERSON,
    9: Treatment.PERSON,
    10: Treatment.PERSON,
    70: Treatment.HALT,
    129: Treatment.PERSON,
    130: Treatment.PERSON,
    141: Treatment.PERSON,
    143: Treatment.PERSON,
}
"""Treatment of each exit code, for an error whose name is not known here."""

_P, _O, _B, _H = Treatment.PERSON, Treatment.OFF, Treatment.BUSY, Treatment.HALT

BY_ERROR: Final = {
    "AmbiguousPosesError": _P,
    "BusyError": _B,
    "CalibrationError": _P,
    "ChainConflictError": _P,
    "ConfigError": _P,
    "ConnectError": _O,
    "ControllerError": _P,
    "ControllerFaultError": _P,
    "DeclinedError": _P,
    "DocumentError": _P,
    "EmptyJournalError": _H,
    "FaultNotPossibleError": _P,
    "HeartbeatLostError": _P,
    "JournalError": _H,
    "LeaseHeldError": _B,
    "LeaseLostError": _B,
    "LimitError": _P,
    "LineJobError": _H,
    "LocalProtocolError": _P,
    "LoginRefusedError": _P,
    "LoginUnansweredError": _O,
    "MapDiffersError": _P,
    "MotionTimeoutError": _P,
    "MovedRecordError": _P,
    "NotAllowedError": _P,
    "NotAtHomeError": _P,
    "NotComparedError": _P,
    "NotNowError": _P,
    "NotReadyError": _P,
    "OpenLineJobsError": _H,
    "OutcomeUnknownError": Treatment.UNSETTLED,
    "PlanError": _H,
    "PlantError": _H,
    "PlantVersionError": _H,
    "ProgramRefused": _P,
    "ProtocolError": _P,
    "ReadBackError": _P,
    "RejectedError": _P,
    "RemoteProtocolError": _P,
    "ReservedToolError": _P,
    "RobolinkError": _H,
    "SelectedToolError": _P,
    "StateNotKeptError": _P,
    "StoppedError": _P,
    "StructuredTextError": _P,
    "TakenAgainError": _P,
    "ToolChangedError": _P,
    "ToolError": _P,
    "ToolIndexError": _P,
    "TransportBrokenError": _O,
    "TransportClosedError": _O,
    "TransportError": _O,
    "TransportTimeoutError": _O,
    "UnclearAnswerError": _P,
    "UndefinedToolError": _P,
    "UnknownActError": _P,
    "_UnknownTool": _P,
    "VerifyError": _P,
}
"""Treatment of each error, where the exit code is that of the error itself."""

BY_REASON: Final = dict.fromkeys(NotReadyReason, Treatment.PERSON) | {
    NotReadyReason.RUNNING: Treatment.BUSY,
    NotReadyReason.STARTING: Treatment.BUSY,
}
"""Treatment of a ``NotReadyError`` by its reason: production that runs is a busy cell."""

_LAST_WORD: Final = (0, 1, 6, 70, 129, 130, 141, 143)
"""Exit codes that outrank the error's name: what stands, and what ended the process."""


def treatment_of(code: int, error: str = "", reason: str = "") -> Treatment:
    """Return what becomes of a job that ended.

    Args:
        code: Its exit code. One that is in no table halts the plan: nobody knows what it means.
        error: Name of the error, ``error.kind`` of its document; empty for none.
        reason: ``error.reason`` of its document, for a ``NotReadyError``.

    Example:
        >>> from robolink.fleet import treatment_of
        >>> treatment_of(5, "NotReadyError", "guard_open"), treatment_of(5, "LeaseHeldError")
        (<Treatment.PERSON: 'person'>, <Treatment.BUSY: 'busy'>)
        >>> treatment_of(6, "TransportBrokenError")
        <Treatment.UNSETTLED: 'unsettled'>
    """
    by_code = BY_CODE.get(code, Treatment.HALT)
    if code in _LAST_WORD or code not in BY_CODE:
        return by_code
    if error == "NotReadyError" and reason in BY_REASON:
        return BY_REASON[NotReadyReason(reason)]
    return BY_ERROR.get(error, by_code)


MOST_TRIES: Final = 20
"""How often a job is begun at most: with the pauses between, about seven hours, a night."""

_FIRST_PAUSE_S: Final = 30.0
_LONGEST_PAUSE_S: Final = 1800.0


def pause_s(attempt: int) -> float:
    """Return how long to wait after a vain attempt, s: doubled each time, half an hour at most.

    Args:
        attempt: Its number, from 1.

    Example:
        >>> from robolink.fleet import pause_s
        >>> [pause_s(attempt) for attempt in (1, 2, 3, 20)]
        [30.0, 60.0, 120.0, 1800.0]
    """
    return min(_FIRST_PAUSE_S * 2.0 ** (attempt - 1), _LONGEST_PAUSE_S)
