"""Every exception that robolink raises on purpose.

::

    RobolinkError
    ├── ConfigError (ValueError)           a URL, an option or a file is wrong; nothing was sent
    │   ├── LimitError                     a target or a change lies outside the stated limits
    │   ├── AmbiguousPosesError            a file of poses does not say everything (.asks)
    │   ├── DocumentError                  a JSON document of another class or a newer version
    │   ├── NotComparedError               a value not compared with the machine would change
    │   └── JournalError                   the journal cannot be written or read
    │       └── NotAtHomeError             the cell is changed on another computer, its home
    ├── TransportError                     the connection failed
    │   ├── ConnectError (ConnectionError) no connection
    │   │   └── LoginUnansweredError       a connection, but no answer to the login
    │   ├── TransportTimeoutError (TimeoutError)
    │   ├── TransportClosedError           this side closed it
    │   └── TransportBrokenError           the far side, or the cable, ended it
    ├── ProtocolError                      never raised itself
    │   ├── LocalProtocolError             this side asked for something illegal
    │   ├── RemoteProtocolError            the far side sent something invalid; the session is over
    │   └── UnclearAnswerError             neither done nor refused; it may or may not have run
    ├── ControllerError                    a refusal
    │   ├── RejectedError                  the controller refused the request
    │   │   └── LoginRefusedError          the password is wrong or missing
    │   ├── NotReadyError                  not sent: the state does not allow it (.reason)
    │   ├── ControllerFaultError           the controller is in error
    │   │   └── HeartbeatLostError         it halted a movement because this side fell silent
    │   ├── MotionTimeoutError             a movement took too long and was aborted
    │   └── BusyError                      another operation is in progress
    │       ├── LeaseHeldError             another program or person is changing the controller
    │       └── LeaseLostError             another has changed it meanwhile
    ├── OutcomeUnknownError                sent but not answered: it may or may not have run
    ├── StoppedError                       a stop ended it, from another thread or terminal
    ├── ToolError
    │   ├── ToolIndexError · ReservedToolError · UndefinedToolError
    │   ├── SelectedToolError              the selected tool was not cleared
    │   ├── ToolChangedError               not the value that was expected; nothing was written
    │   └── ReadBackError                  written, but another value came back
    ├── CalibrationError                   the data do not give a trustworthy result (.code)
    ├── VerifyError                        the drift about the new tip is too large
    └── DeclinedError                      a person declined
        └── NotAllowedError                only an engineer may do it

Each error says what happened (:attr:`~RobolinkError.what`), what to do next (``remedy``; both are
``str(error)``), and what it left on the controller (``controller_state``). Foreign exceptions are
converted at the transport boundary only, always ``from`` the original.
"""

from enum import StrEnum
from types import TracebackType
from typing import TYPE_CHECKING

from robolink.messages import joined, listed

__all__ = [
    "AmbiguousPosesError",
    "BusyError",
    "CalibrationError",
    "ConfigError",
    "ConnectError",
    "ControllerError",
    "ControllerFaultError",
    "DeclinedError",
    "DocumentError",
    "HeartbeatLostError",
    "JournalError",
    "LeaseHeldError",
    "LeaseLostError",
    "LimitError",
    "LocalProtocolError",
    "LoginRefusedError",
    "LoginUnansweredError",
    "MotionTimeoutError",
    "NotAllowedError",
    "NotAtHomeError",
    "NotComparedError",
    "NotReadyError",
    "NotReadyReason",
    "OutcomeUnknownError",
    "ProtocolError",
    "ReadBackError",
    "RejectedError",
    "RemoteProtocolError",
    "ReservedToolError",
    "RobolinkError",
    "SelectedToolError",
    "StoppedError",
    "ToolChangedError",
    "ToolError",
    "ToolIndexError",
    "TransportBrokenError",
    "TransportClosedError",
    "TransportError",
    "TransportTimeoutError",
    "UnclearAnswerError",
    "UndefinedToolError",
    "VerifyError",
]

if TYPE_CHECKING:  # not needed until something was sent to a controller
    from robolink.controller_outcome import ControllerOutcome


class RobolinkError(Exception):
    """Base class of all robolink errors.

    Args:
        what: What happened, one sentence.
        remedy: What to do next, one sentence; may be empty when ``what`` says it.
        controller: Identity or URL of the controller concerned, without any password.
        request: The present request, for display.
        raw: The bytes that were read and could not be used.
    """

    def __init__(
        self,
        what: str,
        *,
        remedy: str = "",
        controller: str = "",
        request: str = "",
        raw: bytes = b"",
    ) -> None:
        super().__init__(what)
        self._standing: ControllerOutcome | None = None
        self.what = what
        self.remedy = remedy
        self.controller = controller
        self.request = request
        self.raw = raw

    def __str__(self) -> str:
        between = "\n" if "\n" in self.what else " "  # below a list, not on its last line
        return f"{self.what}{between}{self.remedy}".rstrip()

    def __reduce__(self) -> tuple[object, ...]:
        return (_restored, (type(self), self.args, vars(self)))

    def say_what_stands(self, sentence: str) -> None:
        """List what was left on the controller, below what happened; empty adds nothing."""
        self.what = listed(self.what, [sentence] if sentence else [])

    def advise(self, sentence: str) -> None:
        """Add what else to do, one line at the most, behind what to do; empty adds nothing."""
        self.remedy = joined(" ", filter(None, (self.remedy, sentence)))

    def concern(self, controller: str, request: str = "") -> None:
        """Name the controller and the request, unless they were named nearer to the cause."""
        self.controller = self.controller or controller
        self.request = self.request or request

    @property
    def controller_state(self) -> "ControllerOutcome":
        """What the block that this error ended left on the controller.

        That is a write, a change, a procedure or a whole connection, whichever was the outermost
        that this error has left.
        """
        if self._standing is not None:
            return self._standing
        from robolink.controller_outcome import UNTOUCHED

        return UNTOUCHED

    @controller_state.setter
    def controller_state(self, outcome: "ControllerOutcome") -> None:
        self._standing = outcome


def _restored(
    kind: type[RobolinkError], args: tuple[object, ...], held: dict[str, object]
) -> RobolinkError:
    """Return a copied or pickled error, whatever else its class asks for when one is made."""
    error = kind.__new__(kind, *args)
    vars(error).update(held)
    return error


class Concerning:
    """Adds the controller and the request to each error that leaves the block.

    An error inside a driver says what happened; this adds the controller, once, at its border. No
    generator: every procedure passes here.

    Args:
        controller: Identity of the controller.
        request: What it was asked.
    """

    __slots__ = ("_controller", "_request")

    def __init__(self, controller: str, request: str = "") -> None:
        self._controller, self._request = controller, request

    def __enter__(self) -> None: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if isinstance(error, RobolinkError):
            error.concern(self._controller, self._request)


class ConfigError(RobolinkError, ValueError):
    """A URL, an option, a value or a file is wrong. Nothing was sent."""


class LimitError(ConfigError):
    """A target, a step or a change exceeds a limit. Nothing was sent."""


class AmbiguousPosesError(ConfigError):
    """A file of poses can be read in more than one way. Nothing was guessed or sent.

    Attributes:
        asks: What the file does not say: ``columns``, ``length``, ``euler``.
        reason: The same as one text, with commas.
    """

    def __init__(self, what: str, *, asks: tuple[str, ...], remedy: str = "") -> None:
        super().__init__(what, remedy=remedy)
        self.asks = asks
        self.reason = ",".join(asks)


class DocumentError(ConfigError):
    """A value has no JSON document, or a document is of another class or a newer version."""


class NotComparedError(ConfigError):
    """A write would change what nobody compared with the machine's screen. Nothing was sent.

    Attributes:
        tool: Number of the tool.
        components: Those that would change and were not compared; all of the tool where nothing
            of it was.
    """

    def __init__(
        self, what: str, *, tool: int, components: tuple[str, ...], remedy: str = ""
    ) -> None:
        super().__init__(what, remedy=remedy)
        self.tool = tool
        self.components = components


class JournalError(ConfigError):
    """The journal cannot be opened, read or added to."""


class NotAtHomeError(JournalError):
    """The cell is changed on another computer alone, its home; nothing was sent."""


class TransportError(RobolinkError):
    """The connection failed."""


class ConnectError(TransportError, ConnectionError):
    """No connection could be made."""


class LoginUnansweredError(ConnectError):
    """The port answers, but the login does not.

    EPSON controllers serve one remote client at a time (docs/reference/epson.md 1.1); what a second
    one sees is not documented, so silence and a closed connection both end here.
    """


class TransportTimeoutError(TransportError, TimeoutError):
    """Nothing came before the deadline. The link cannot be used again."""


class TransportClosedError(TransportError):
    """The link was used after this side had closed it."""


class TransportBrokenError(TransportError):
    """The far side, or the cable, ended the link."""


class ProtocolError(RobolinkError):
    """Base class of the two protocol errors; never raised itself."""


class LocalProtocolError(ProtocolError):
    """This side asked for something that the protocol forbids. Nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The far side sent something invalid. The session is over."""


class UnclearAnswerError(ProtocolError):
    """An answer in its place that says neither that a command ran nor that it was refused.

    One garbled character makes it (``#Execute,1``), and so does a controller that gives up a
    statement half-way without an error state (``!Execute,99``). The session continues, so the
    outcome of the command can be read.
    """


class ControllerError(RobolinkError):
    """The controller refused, or a check of its state did.

    Attributes:
        code: The controller's own number, 0 when there is none.
    """

    def __init__(
        self,
        what: str,
        *,
        code: int = 0,
        remedy: str = "",
        controller: str = "",
        request: str = "",
        raw: bytes = b"",
    ) -> None:
        super().__init__(what, remedy=remedy, controller=controller, request=request, raw=raw)
        self.code = code


class RejectedError(ControllerError):
    """The controller answered with a refusal; it did not act."""


class LoginRefusedError(RejectedError):
    """The password is wrong or missing. One login was attempted, no more will be."""


class NotReadyReason(StrEnum):
    """Why a command was not sent."""

    NOT_REMOTE = "not_remote"
    TEACH = "teach"
    TEST = "test"
    RUNNING = "running"
    PAUSED = "paused"
    EMERGENCY_STOP = "emergency_stop"
    GUARD_OPEN = "guard_open"
    FAULT = "fault"
    SERIOUS_FAULT = "serious_fault"
    STARTING = "starting"
    MOTORS_OFF = "motors_off"
    HIGH_POWER = "high_power"
    ACCELERATION = "acceleration"
    WRONG_TOOL = "wrong_tool"
    NO_REMOTE_TIMEOUT = "no_remote_timeout"
    NO_ABORT = "no_abort"
    EDGE_PASSED = "edge_passed"
    DRY_RUN = "dry_run"
    VIRTUAL_IO = "virtual_io"
    OTHER_ROBOT = "other_robot"
    OTHER_BASE = "other_base"
    NOT_PERMITTED = "not_permitted"


class NotReadyError(ControllerError):
    """The controller's state does not allow the command, so it was not sent.

    Attributes:
        reason: The named state.
    """

    def __init__(
        self,
        what: str,
        *,
        reason: NotReadyReason,
        code: int = 0,
        remedy: str = "",
        controller: str = "",
        request: str = "",
    ) -> None:
        self.reason = reason
        super().__init__(what, code=code, remedy=remedy, controller=controller, request=request)


class ControllerFaultError(ControllerError):
    """The controller is in its error state, or has just entered it."""


class HeartbeatLostError(ControllerFaultError):
    """The controller halted a movement because it heard nothing from this computer for too long.

    Nothing else is wrong: the tool stays, and the movement may be commanded again.
    """


class MotionTimeoutError(ControllerError):
    """A movement did not end in time; it was aborted, and its end was seen."""


class BusyError(ControllerError):
    """Another operation has the controller locked. Nothing was sent."""


class LeaseHeldError(BusyError):
    """Another program or person is changing the controller. Nothing was sent.

    Attributes:
        holder: Who, in the controller's own words; empty where it has none.
    """

    holder: str = ""


class LeaseLostError(BusyError):
    """Another user took the controller over, or changed it since it was read. Nothing was sent."""


class OutcomeUnknownError(RobolinkError):
    """A command was sent and no answer came: it may or may not have run.

    Motion on that controller is blocked until ``recover``; nothing is sent again.
    """


class StoppedError(RobolinkError):
    """A stop from another thread, another terminal or a person.

    The stop ended what was in progress, and nothing that moves or writes leaves this process
    until the stop is released.
    """


class ToolError(RobolinkError):
    """Base class of errors about a tool."""


class ToolIndexError(ToolError, ValueError):
    """There is no tool with this number."""


class SelectedToolError(ToolError):
    """The selected tool was not cleared: no replacement was named."""


class ReservedToolError(ToolError):
    """Tool 0 is the flange itself and is never written."""


class UndefinedToolError(ToolError):
    """The tool has no definition."""


class ToolChangedError(ToolError):
    """The stored value is not the one that was expected. Nothing was written."""


class ReadBackError(ToolError):
    """The value read after the write is not the value written."""


class CalibrationError(RobolinkError):
    """The measurements do not support a result.

    Attributes:
        code: The named reason, for example ``insufficient_rotation``; the most important one.
        others: Further reasons that apply as well.
    """

    def __init__(
        self, code: str, what: str, *, remedy: str = "", others: tuple[str, ...] = ()
    ) -> None:
        super().__init__(what, remedy=remedy)
        self.code = code
        self.others = others


class VerifyError(RobolinkError):
    """The turn test did not confirm the tip; the old value was restored.

    Attributes:
        code: The named reason, such as ``large_drift`` or ``not_touched``; empty for none.
        next_commands: What a person chose to do next, each after ``robolink`` and the name of the
            cell; empty for beginning the same again.
    """

    def __init__(
        self, what: str, *, remedy: str = "", code: str = "", controller: str = ""
    ) -> None:
        super().__init__(what, remedy=remedy, controller=controller)
        self.code = code
        self.next_commands: tuple[str, ...] = ()


class DeclinedError(RobolinkError):
    """A person declined, or nobody could be asked."""


class NotAllowedError(DeclinedError):
    """Only an engineer may do this, by the people or limits of the cell file. Nothing was sent."""
