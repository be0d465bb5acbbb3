"""What a controller offers its user, what only some kinds have, and whether it is simulated."""

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from types import TracebackType
from typing import ClassVar, Final, Generic, Protocol, Self, TypeVar

from robolink.errors import ConfigError, ControllerError
from robolink.messages import tr
from robolink.model._change_limits import ChangeGuard
from robolink.model._geometry import Pose
from robolink.model._identity import ControllerFacts
from robolink.model._journal_entries import NewEntry
from robolink.model._ledger import Ledger
from robolink.model._movement import MotionGroup
from robolink.model._outcomes import Marker, MarkerKind, OutcomeLog, Resolver
from robolink.model._status import ControllerStatus
from robolink.model._tools import ToolTable
from robolink.stop_latch import Patience, StopLatch
from robolink.timing import AnswerTimes, Clock

Value = bool | int | float | str
ValueT = TypeVar("ValueT", bound=Value)


@dataclass(frozen=True, slots=True)
class ValueReceipt(Generic[ValueT]):
    """The result of setting a value.

    Attributes:
        request: The request, as sent on the wire.
        before: The earlier value.
        requested: The requested value.
        read_back: The present value.
        skipped: It was there already, so nothing was sent.
    """

    request: str
    before: ValueT
    requested: ValueT
    read_back: ValueT
    skipped: bool


class DigitalIo(Protocol):
    """Inputs and outputs by number."""

    def read_input(self, bit: int) -> bool:
        """Read one input."""

    def set_output(self, bit: int, on: bool) -> ValueReceipt[bool] | None:
        """Switch one output, and confirm it as far as this controller allows.

        Returns:
            ``None`` if an output cannot be read back: only the acknowledgement confirms it.

        Raises:
            NotReadyError: The state forbids it.
            RejectedError: It was refused; nothing was switched.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """

    def preview_output(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send, as sent on the wire."""


class PointReader(Protocol):
    """The taught points of a controller."""

    def read_all(self, numbers: Iterable[int]) -> Mapping[int, Pose | None]:
        """Read some of them; an undefined one is ``None``."""


class VariableTable(Protocol):
    """Variables of the program in a controller, by name and by the name of their type."""

    def read(self, name: str, kind: str) -> Value:
        """Read one variable."""

    def write(self, name: str, value: Value, kind: str) -> ValueReceipt[Value]:
        """Set one variable and read it back; raises like :meth:`DigitalIo.set_output`.

        Args:
            name: Name of the variable, as the project of the controller has it.
            value: The new value.
            kind: Its type, such as ``Real``.

        Example:
            >>> import robolink
            >>> from robolink.protocols.epson_text import VariableType
            >>> from robolink_simulators.epson import EpsonSimulator
            >>> from robolink_simulators.hosting.in_process.epson import register
            >>> simulator = EpsonSimulator()
            >>> simulator.variables.declare("g_height", VariableType.REAL)
            >>> with robolink.connect(register("variable-example", simulator)) as controller:
            ...     receipt = controller.variables.write("g_height", 2.5, "Real")
            >>> receipt.before, receipt.read_back
            (0.0, 2.5)
        """

    def preview_write(self, name: str, value: Value, kind: str) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads; reads only.

        Args:
            name: Name of the variable.
            value: What it would hold.
            kind: Its type.

        Example:
            >>> import robolink
            >>> from robolink_simulators.epson import EpsonSimulator
            >>> from robolink_simulators.hosting.in_process.epson import register
            >>> simulator = EpsonSimulator()
            >>> simulator.variables.declare("g_height", "real")
            >>> with robolink.connect(register("preview-example", simulator)) as controller:
            ...     controller.variables.preview_write("g_height", 2.5, "real")
            ('$SetVariable,g_height,2.5,Real',)
        """


class AlarmList(Protocol):
    """What needs attention on a controller, apart from errors."""

    def list(self) -> tuple[int, ...]:
        """Read the numbers of the active alarms.

        Raises:
            RejectedError: This firmware does not report them.
        """

    def reset(self, number: int) -> None:
        """Reset one alarm at a person's request, and confirm that it is gone."""


class Act(StrEnum):
    """An action that a person requests of a controller as a whole."""

    STOP = "stop"
    RESET = "reset"
    MOTORS_ON = "motors on"
    MOTORS_OFF = "motors off"


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What this kind of controller supports.

    The last four say whether the controller has the attribute of that name.

    Attributes:
        pose_while_moving: Whether a position can be read while a movement is in progress; if not,
            the only line to the controller is busy until its end.
        low_power: Whether each movement uses a gentle power mode of the controller.
        looks: Whether it has a vision system of its own (:class:`LookingController`).
        inputs_only: Whether ``io`` reads inputs and switches no output.
        acceleration: Whether its straight movements stay below an acceleration that the cell
            states.
    """

    json_version: ClassVar = 2

    tool_write: bool = False
    motion: bool = False
    motors: bool = False
    pose_while_moving: bool = False
    low_power: bool = False
    looks: bool = False
    inputs_only: bool = False
    acceleration: bool = False
    io: bool = False
    points: bool = False
    variables: bool = False
    alarms: bool = False


ACCELERATION_RANGE_MM_S2: Final = (100, 35_000)
"""What a cell may state: braking with less is none (docs/reference/evidence.md 13), and no AccelS
is higher (docs/reference/spel.md 7.2)."""


def require_acceleration(stated_mm_s2: int, controller: "Controller | None" = None) -> None:
    """Refuse a highest acceleration of straight movements that no cell may state.

    Args:
        stated_mm_s2: The acceleration.
        controller: Whose movements have to keep it.

    Raises:
        ConfigError: It is no whole number in the range, or the controller keeps to none.

    Example:
        >>> from robolink.model import require_acceleration
        >>> require_acceleration(150)
    """
    low, high = ACCELERATION_RANGE_MM_S2
    if type(stated_mm_s2) is not int or not low <= stated_mm_s2 <= high:
        raise ConfigError(
            tr("The highest acceleration cannot be {given!r} mm/s^2.", given=stated_mm_s2),
            remedy=tr("Give a whole number from {low} to {high}.", low=low, high=high),
        )
    if controller is not None and not controller.capabilities.acceleration:
        raise ConfigError(
            tr(
                "robolink cannot limit the acceleration of {controller}, and the cell states one.",
                controller=controller.identity,
            ),
            remedy=tr("Remove acceleration_mm_s2 from the cell file, or from the call."),
        )


class Controller(Protocol):
    """A connected controller.

    Every call may raise a TransportError or RemoteProtocolError. Then a new connection is needed.
    """

    @property
    def identity(self) -> str:
        """How it is reached: the URL, without passwords and without options that name nothing.

        The identity that does not depend on the URL is ``outcomes.identity``.
        """

    @property
    def clock(self) -> Clock:
        """The clock on which this controller's time passes."""

    @property
    def capabilities(self) -> Capabilities:
        """What it supports."""

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
    def traffic_bytes(self) -> int | None:
        """Bytes sent and received so far; ``None`` where its link does not count them."""

    @property
    def answers(self) -> AnswerTimes | None:
        """How long it takes to answer; ``None`` for a kind that does not measure it."""

    @property
    def outcomes(self) -> OutcomeLog:
        """The outcomes in doubt and the unfinished procedures of this controller."""

    @property
    def ledger(self) -> Ledger:
        """What was done to it since connecting, and how much of that is confirmed."""

    @property
    def resolver(self) -> Resolver:
        """Finishes or undoes interrupted jobs."""

    def status(self) -> ControllerStatus:
        """Read the state flags."""

    def condition(self) -> Mapping[str, object]:
        """Read more about the state than the flags show, plain JSON.

        What cannot be read now, or not by this kind of controller, is ``None`` or left out.
        """

    def preview(self, act: Act) -> tuple[str, ...]:
        """Return the requests of an action, as sent on the wire. Reads at most."""

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are."""

    @property
    def change_guard(self) -> ChangeGuard:
        """Refuses writes that move a tip farther than the cell allows."""

    @property
    def latch(self) -> StopLatch:
        """Refuses everything from :meth:`stop` until :meth:`release_stop`."""

    @property
    def patience(self) -> Patience:
        """How long a call waits that is refused because another user has the controller locked."""

    def stop(self) -> None:
        """Stop everything; from any thread, at any time, more than once.

        It sets the latch before it waits for anything: until :meth:`release_stop` no movement,
        jog, write or program start leaves this process. Only the earlier tool, power and speed
        may be restored, and each tool of an open change once. Whoever was working gets
        StoppedError. It returns when the controller has confirmed that it has stopped.

        Raises:
            OutcomeUnknownError: The stop is not confirmed; the message says to use the emergency
                stop.
        """

    def release_stop(self) -> None:
        """Release a stop at a person's request: this process may act again."""

    def reset_fault(self) -> None:
        """Clear an error at a person's request."""

    def motors(self, on: bool) -> None:
        """Switch the motors on or off."""

    def take_over(self, reason: str) -> None:
        """Take the controller over from the user who has it locked, at a person's request.

        The journal records who took over and why. The next action of the earlier user is refused:
        its lease has another epoch, and so has a PLC's mailbox. What it began stays open here.

        Args:
            reason: Why, in the person's words.

        Raises:
            ConfigError: It cannot be recorded; nothing was taken.
        """

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while an earlier job is unfinished.

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
            request: What is started, for display.
            details: Plain JSON values needed to recover it.
            operation: Id of an earlier marker whose work is taken up; empty for a new one.

        Raises:
            ConfigError: It cannot be stored; nothing may be sent.
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
        """Remove the marker of a procedure, and record how it ended."""

    def procedure(
        self, request: str, *, wait_s: float | None = None
    ) -> AbstractContextManager[None]:
        """Let only this thread change something on the controller within the block.

        Changes by other threads are refused with BusyError meanwhile, or wait. If this call may
        wait, it takes the lease as well, so that no other program comes in between. The block
        belongs to the thread that entered it.

        Args:
            request: What the block does, for display.
            wait_s: How long to wait for others, in seconds, 0 not at all; ``None`` for
                ``patience.wait_s``.

        Raises:
            BusyError: Others are still working.
            StoppedError: A stop came while this waited.

        Example:
            >>> import robolink
            >>> from robolink import ToolOffset
            >>> with robolink.connect("epson+sim://procedure-example") as controller:
            ...     with controller.procedure("move tool 1 by 0.1 mm", wait_s=10):
            ...         old = controller.tools.read(1)
            ...         new = ToolOffset(old.x_mm + 0.1, old.y_mm, old.z_mm)
            ...         receipt = controller.tools.write(1, new, expected=old)
        """

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Delay Ctrl-C for a block that must be completed."""

    def signs_of_life(self) -> AbstractContextManager[None]:
        """Show others within the block, once a second, that this process is at work.

        They go to the record and the controller, for lease and ownership alone: they send no
        command and sustain no movement. None is given while a movement is unfinished on which
        nobody waits.

        Example:
            >>> import robolink
            >>> with robolink.connect("epson+sim://life-example") as controller:
            ...     with controller.outcomes.hold("a look"), controller.signs_of_life():
            ...         tools = controller.tools.read(1)
        """

    def preserved(self, reason: str) -> AbstractContextManager[None]:
        """Restore, at the end of the block, the tool, power and speed of its start.

        A durable marker names the tool until that has been read back.
        """

    def close(self) -> None:
        """Log out if that is harmless, and close the link. Idempotent."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


_SERIAL: Final = re.compile(r"(?:C-)?SIM[0-9A-F]{8}")
"""Serial numbers of simulated EPSON controllers and robots; those of other makers are unknown."""

_MEDIUM: Final = "+sim://"
"""Part of the URL of a simulator that runs in the process that uses it."""


def is_simulated_name(name: str) -> bool:
    """Return whether the name of a controller, or a serial number, is a simulator's.

    ``False`` says nothing: the name of a PLC does not tell.

    Args:
        name: An identity, an address or a serial number.

    Example:
        >>> from robolink.model import is_simulated_name
        >>> is_simulated_name("epson:C-SIM0A1B2C3D/SIM0A1B2C3D"), is_simulated_name("softmotion:1A")
        (True, False)
    """
    return _MEDIUM in name or any(map(_SERIAL.fullmatch, re.split(r"[:/+#]", name)))


def are_simulated_facts(facts: ControllerFacts) -> bool:
    """Return whether the serial numbers of a controller or its robots are a simulator's."""
    return any(map(is_simulated_name, (facts.controller_serial or "", *facts.robot_serials)))


def says_it_is_simulated(controller: Controller, facts: ControllerFacts | None = None) -> bool:
    """Return whether a controller says that nothing real moves; without an answer, an error.

    A PLC reports it for its axes, in the mailbox (docs/reference/mailbox.md); a simulated EPSON
    controller by its serial numbers. One that cannot answer just now reports nothing.

    Args:
        controller: The controller; what can be read is read.
        facts: Its earlier answer, if it was asked already.

    Example:
        >>> from robolink import connect
        >>> from robolink.model import says_it_is_simulated
        >>> with connect("softmotion+sim://simulated-example") as controller:
        ...     says_it_is_simulated(controller)
        True
    """
    if is_simulated_name(controller.identity):
        return True
    try:
        known = controller.facts() if facts is None else facts
        return are_simulated_facts(known) or controller.condition().get("simulated") is True
    except ControllerError:
        return False
