"""What a controller is to its user."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import Protocol, Self

from robolink.model._change_limits import ChangeGuard
from robolink.model._identity import ControllerFacts
from robolink.model._optional_parts import AlarmList, DigitalIo, PointReader, VariableTable
from robolink.model._status import ControllerStatus
from robolink.model._tools import ToolTable
from robolink.model.motion.movement import MotionGroup
from robolink.model.record.findings import Resolver
from robolink.model.record.journal_entries import NewEntry
from robolink.model.record.ledger import Ledger
from robolink.model.record.outcomes import Marker, MarkerKind, OutcomeLog
from robolink.stop_latch import StopLatch
from robolink.timing import Clock


class Act(StrEnum):
    """What a person asks of a controller as a whole."""

    STOP = "stop"
    RESET = "reset"
    MOTORS_ON = "motors on"
    MOTORS_OFF = "motors off"


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What this kind of controller can be asked for.

    The last four say that the controller's attribute of that name is there.

    Attributes:
        pose_while_moving: Whether a position can be read while a movement is under way; else the
            one line to the controller is waited on.
        low_power: Whether each movement is made in a power mode of the controller's that is
            gentle.
        looks: Whether it has a vision system of its own (:class:`LookingController`).
        inputs_only: Whether ``io`` reads inputs and switches no output.
    """

    tool_write: bool = False
    motion: bool = False
    motors: bool = False
    pose_while_moving: bool = False
    low_power: bool = False
    looks: bool = False
    inputs_only: bool = False
    io: bool = False
    points: bool = False
    variables: bool = False
    alarms: bool = False


class Controller(Protocol):
    """A controller that someone is connected to.

    Every call may raise a TransportError or RemoteProtocolError; after one the link is dead
    and a new connection is needed.
    """

    @property
    def identity(self) -> str:
        """How it is reached: the URL, without passwords and without options that name nothing.

        Who it is, whatever the URL, is ``outcomes.identity``.
        """

    @property
    def clock(self) -> Clock:
        """The clock on which this controller's time passes."""

    @property
    def capabilities(self) -> Capabilities:
        """What can be asked for."""

    @property
    def tools(self) -> ToolTable:
        """The tool offsets."""

    @property
    def groups(self) -> Sequence[MotionGroup]:
        """What moves."""

    @property
    def io(self) -> DigitalIo | None:
        """Inputs and outputs; ``None`` for a kind that has none."""

    @property
    def points(self) -> PointReader | None:
        """Points that a person taught; ``None`` for a kind that has none."""

    @property
    def variables(self) -> VariableTable | None:
        """Variables of the machine's program; ``None`` for a kind that has none."""

    @property
    def alarms(self) -> AlarmList | None:
        """Alarms beside the error state; ``None`` for a kind that has none."""

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""

    @property
    def outcomes(self) -> OutcomeLog:
        """The doubtful outcomes and the unfinished procedures of this controller."""

    @property
    def ledger(self) -> Ledger:
        """What was done to it since connecting, and how much of that is proved."""

    @property
    def resolver(self) -> Resolver:
        """Settles what was begun here and not proved finished."""

    def status(self) -> ControllerStatus:
        """Read the state flags."""

    def condition(self) -> Mapping[str, object]:
        """Read more about the state than the flags say, plain JSON.

        What cannot be read now, or not by this kind of controller, is ``None`` or left out.
        """

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an act, as they stand on the wire. Reads at most."""

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are."""

    @property
    def change_guard(self) -> ChangeGuard:
        """What holds back writes that take a tip farther than the cell allows."""

    @property
    def latch(self) -> StopLatch:
        """What holds everything back from :meth:`stop` until :meth:`release_stop`."""

    def stop(self) -> None:
        """Stop everything; from any thread, at any time, more than once.

        It sets the latch before it waits for anything: until :meth:`release_stop` no movement,
        jog, write or program start leaves this process. Only the tool, power and speed of
        before may be put back, and each tool of an open change once. Whoever was at work gets
        StoppedError. It returns when the controller has shown that it is at rest.

        Raises:
            OutcomeUnknownError: Rest was not seen; the message says to use the emergency stop.
        """

    def release_stop(self) -> None:
        """Let this process act again after :meth:`stop`, because a person says so."""

    def reset_fault(self) -> None:
        """Clear an error because a person asked for it."""

    def motors(self, on: bool) -> None:
        """Switch the motors."""

    def take_over(self, reason: str) -> None:
        """Take the controller over from whoever works on it, because a person insists.

        The record keeps who insisted and why. The next act of whoever had it is refused: its
        lease has another epoch, and so has a PLC's mailbox. What it began stays open here.

        Args:
            reason: Why, in the person's words.

        Raises:
            ConfigError: It cannot be recorded; nothing was taken.
        """

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while something earlier is unsettled.

        Raises:
            OutcomeUnknownError: Names it.
        """

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store the durable marker of a procedure of several steps.

        Args:
            kind: What it stands for.
            request: What is begun, as a person may read it.
            details: Plain JSON values needed to settle it.
            operation: Id of a marker of before whose work is taken up; empty for a new one.

        Raises:
            ConfigError: That is impossible; nothing may be sent.
            BusyError: Another process has the controller.

        Example:
            >>> import robolink
            >>> from robolink.model import MarkerKind
            >>> with robolink.connect("epson+sim://begin-example") as controller:
            ...     marker = controller.begin(MarkerKind.CHANGE, "change of tool 1", {"tools": {}})
            ...     controller.finish(marker)
            >>> marker.request
            'change of tool 1'
        """

    def finish(self, marker: Marker, *entries: NewEntry) -> None:
        """Forget the marker of a procedure, and journal how it ended."""

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Hold Ctrl-C back for a block that must be seen through."""

    def signs_of_life(self) -> AbstractContextManager[None]:
        """Let others see within the block, once a second, that this process is at work.

        The record and the controller are told, for lease and ownership alone: no command is
        sent and no movement kept going. While a movement is unfinished on which nobody waits,
        none is given.

        Example:
            >>> import robolink
            >>> with robolink.connect("epson+sim://life-example") as controller:
            ...     with controller.outcomes.hold("a look"), controller.signs_of_life():
            ...         tools = controller.tools.read(1)
        """

    def preserved(self, reason: str) -> AbstractContextManager[None]:
        """Put back, at the end of the block, the tool, power and speed in force at its start.

        A durable marker names the tool until that has been read back.
        """

    def close(self) -> None:
        """Log out where that does no harm and close the link. Idempotent."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
