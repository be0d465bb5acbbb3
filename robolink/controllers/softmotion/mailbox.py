"""What every part of this driver uses: one mailbox, its commands and its markers.

Which PLC answers: the number that it drew once, the same on every link.

Inputs and outputs that the PLC's program offers by number (opcodes 30006 and 30007).

Source: docs/reference/mailbox.md, "Which PLC this is".
"""

import math
from collections.abc import Callable, Mapping
from typing import Final, Protocol, TypeVar

from robolink import runtime
from robolink.controllers.driver_link import DriverLink, DriverPart, MarkedCommand
from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.commands import CommandSender
from robolink.controllers.softmotion.condition import require_permit
from robolink.controllers.softmotion.ownership import Bystanders
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import RejectedError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Identity, OutcomeLog, Pose, ToolOffset, of_no_tool, require_offset
from robolink.protocols.mailbox import (
    Bits,
    Command,
    Opcode,
    Response,
    Six,
    Slot,
    decode_device_id,
    frames_match,
    from_frame,
    to_frame,
)
from robolink.timing import SteppedClock

_READS: Final = 3
"""Number of readings: a PLC may be drawing its number during the first one."""


class DeviceReading(Protocol):
    """A :class:`robolink.transport.MailboxLink`, as far as needed here."""

    def read_device(self) -> tuple[int, ...]:
        """Return the words of the device block."""


def read_device_id(link: DeviceReading) -> int | None:
    """Return the number of the PLC behind a link; it changes nothing.

    Returns:
        ``None`` when its mailbox program has no such number: such a PLC can be known by its
        address only.

    Raises:
        TransportError, RemoteProtocolError: The link failed.
    """
    for _ in range(_READS):
        try:
            words = link.read_device()
        except RejectedError:  # nothing exists at that address
            return None
        device_id = decode_device_id(words)
        if device_id is not None or not any(words[:2]):
            return device_id
    return None


def identity_of(wire: MailboxWire, device_id: int | None) -> Identity:
    """Return who a PLC is, the same over each medium.

    Source: docs/reference/mailbox.md, "Which PLC this is".

    Args:
        wire: The session.
        device_id: What it said when it was met; ``None`` for a program of before that number,
            which is known by its address.
    """
    place = f"softmotion@{wire.place}"
    name = place if device_id is None else f"softmotion:{device_id:08X}"
    return Identity(name, wire.identity, place)


TOLERANCE = 1e-9
"""Largest difference between equal LREALs: user units, and elements of a rotation matrix
(docs/reference/rules.md 3)."""

ROUNDED_TILT_DEG = 1e-6
"""Largest tilt that is only rounding in the PLC, degrees: 0.02 um at the end of a tool of 1 m."""


class Mailbox(DriverLink):
    """One connected PLC mailbox.

    Attributes:
        wire: The session.
        snapshots: Reads.
        commands: Commands.
        device_id: The number of the PLC, the same on every link; ``None`` where it has none.
    """

    def __init__(
        self,
        wire: MailboxWire,
        snapshots: Snapshots,
        outcomes: OutcomeLog,
        *,
        device_id: int | None,
        tell: Callable[[str], None] = lambda _sentence: None,
    ) -> None:
        self.wire = wire
        self.device_id = device_id
        self._just_read = True
        outcomes.ask(self._who)
        self.snapshots = snapshots
        self.commands = CommandSender(wire, snapshots, Bystanders(outcomes, tell))
        super().__init__(wire.identity, wire.clock, wire.latch, outcomes, gate=wire.uninterrupted())

    def _who(self) -> Identity:
        """Return who it is: first as read at the connection, from then on anew."""
        if not self._just_read:
            self.device_id = read_device_id(self.wire)
        self._just_read = False
        return identity_of(self.wire, self.device_id)

    @property
    def session_over(self) -> bool:
        """Whether its wire has ended for good."""
        return not self.wire.alive

    @property
    def waited_on(self) -> bool:
        """Whether a thread of this process waits on a movement or keeps a jog going."""
        return self.wire.waited_on

    @property
    def simulated(self) -> bool:
        """Whether the last snapshot reported that the axes are simulated."""
        return bool(self.snapshots.latest.bits & Bits.SIMULATED)

    def show_life(self) -> None:
        """Beat for the ownership alone: nothing while a movement or jog is unfinished."""
        # If only a test advances the time, no time passes for others meanwhile.
        if runtime.steps_time() or not isinstance(self.clock, SteppedClock):
            self.wire.beat_at_rest()

    @property
    def unit_um(self) -> float:
        """Micrometres in one of the PLC's units of length."""
        return self.snapshots.met.unit_um

    def prepare(self, draft: Command, request: str, *, now: Response | None = None) -> Response:
        """Make sure that a command may be sent: the permit is there and the mailbox ours.

        It is done before a marker is begun: what fails here was never sent.

        Args:
            draft: The command.
            request: The same in words.
            now: A snapshot that was taken just now; by default another one is taken.

        Raises:
            NotReadyError: The machine does not permit it.
            LeaseHeldError, LeaseLostError: Another client owns the mailbox.
        """
        with self.asked(request):
            now = now or self.snapshots.take()
            if draft.needs_permit:
                require_permit(now)
            if draft.needs_owner:
                self.lock.patience.until_free(
                    lambda: self.commands.ownership.require(request), request
                )
            return now

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether this PLC stores both alike; rotations are compared as matrices."""
        if a is None or b is None:
            return a is b
        require_offset("a", a)
        require_offset("b", b)
        return a == b or frames_match(self.to_plc(a), self.to_plc(b), tolerance=TOLERANCE)

    def to_plc(self, offset: ToolOffset) -> Six:
        """Return a tool in the PLC's units and angles."""
        return to_frame(offset.components(), unit_um=self.unit_um)

    def from_plc(self, frame: Six) -> ToolOffset:
        """Return a tool that came from the PLC."""
        return ToolOffset(*self.coordinates(frame))

    def tool_in(self, slot: Slot) -> ToolOffset | None:
        """Return the content of a slot, ``None`` when it is empty.

        Values of no tool come as they are: an angle of 1e200 degrees made a rotation would look
        like one that somebody meant.
        """
        if not slot.defined:
            return None
        tool = self.from_plc(slot.tool)
        return ToolOffset(*slot.tool) if of_no_tool(slot.tool) else tool

    def pose(self, frame: Six, *, tool: int | None) -> Pose:
        """Return the place of a frame from the PLC, without tilt that is mere rounding.

        A kinematics that cannot tilt works out its orientation all the same, and not every one
        ends at exactly 0; what only serves an upright flange asks for exactly that.

        Args:
            frame: As the mailbox carries it.
            tool: Whose frame it is, where that is known.

        Raises:
            RemoteProtocolError: A number in it is not finite.
        """
        x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = self.coordinates(frame)
        if max(abs(v_deg), abs(w_deg)) < ROUNDED_TILT_DEG:
            v_deg = w_deg = 0.0
        return Pose(x_mm, y_mm, z_mm, u_deg, v_deg, w_deg, tool=tool)

    def coordinates(self, frame: Six) -> Six:
        """Return x, y, z in mm and u, v, w in degrees of a frame from the PLC.

        Raises:
            RemoteProtocolError: A number in it is not finite.
        """
        x, y, z, *_ = frame
        if not all(map(math.isfinite, (*frame, *(v * self.unit_um for v in (x, y, z))))):
            raise self.wire.ended(
                RemoteProtocolError(
                    tr("{identity} sent a position that is not a number.", identity=self.identity),
                    remedy=tr("Look at the PLC's axes and kinematics, then connect again."),
                )
            )
        return from_frame(frame, unit_um=self.unit_um)


T = TypeVar("T")


class MarkedDraft(MarkedCommand[T]):
    """A command of a mailbox that is marked meanwhile.

    Args:
        mailbox: Where it is sent.
        draft: The command.
        details: Plain JSON values needed to recover it later.
        read: Reads what it changes.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        draft: Command,
        details: Mapping[str, object],
        read: Callable[[], T],
    ) -> None:
        super().__init__(describe(draft))
        self._mailbox, self._draft = mailbox, draft
        self._details, self._read = details, read

    @property
    def details(self) -> Mapping[str, object]:
        """Plain JSON values needed to recover it later."""
        return self._details

    def send(self) -> None:
        """Send it; raises unless the PLC accepted it."""
        self._mailbox.commands.carry_out(self._draft)

    def read(self) -> T:
        """Read what it changes."""
        return self._read()


class SoftMotionIo(DriverPart):
    """Reads inputs and sets outputs; both need the ownership.

    An output cannot be read back through the mailbox: the PLC's acknowledgement is the proof.
    """

    def __init__(self, mailbox: Mailbox) -> None:
        super().__init__(mailbox)
        self._mailbox = mailbox

    def read_input(self, bit: int) -> bool:
        """Read whether an input is on; raises like :meth:`read_value`."""
        return self.read_value(bit) != 0

    def read_value(self, number: int) -> int:
        """Read an input as the number, 0 to 65535, that the PLC's program gives for it.

        Raises:
            LeaseHeldError, LeaseLostError: Another client owns the mailbox.
            RejectedError: There is no such input, or the program offers none.
        """
        draft = Command(0, Opcode.READ_INPUT, operands=(number, 0, 0, 0))
        return self._mailbox.commands.carry_out(draft).answer.input_value

    def set_output(self, bit: int, on: int) -> None:
        """Set an output, to 0 or 1 or to a number that the PLC's program understands.

        Raises:
            NotReadyError: The machine does not permit it.
            RejectedError: There is no such output; nothing was written.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """
        draft = _set_draft(bit, on)
        mailbox, request = self._mailbox, describe(draft)
        with mailbox.lock.held(request):
            mailbox.prepare(draft, request)
            marked = {"output": bit, "requested": int(on)}
            mailbox.carry_out(MarkedDraft(mailbox, draft, marked, _read_nothing))

    def preview_output(self, bit: int, on: int) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send, in words."""
        return (describe(_set_draft(bit, on)),)


def _set_draft(number: int, value: int) -> Command:
    return Command(0, Opcode.WRITE_OUTPUT, operands=(number, int(value), 0, 0))


def _read_nothing() -> None:
    """Read nothing: an output cannot be read back."""
