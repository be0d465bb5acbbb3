"""What a mailbox reports about the machine behind it.

What a PLC's mailbox shows of itself, reading only: for a person who has just loaded it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.condition import require_still
from robolink.controllers.softmotion.mailbox import Mailbox, MarkedDraft
from robolink.errors import ReadBackError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import ControllerFacts, of_no_tool
from robolink.protocols.mailbox import (
    OPCODES,
    PROBE,
    SLOTS,
    Bits,
    Capability,
    Command,
    GroupState,
    Kinematics,
    Opcode,
    Response,
    kinematics_word,
)
from robolink.timing import NS_PER_S


@dataclass(frozen=True, slots=True)
class MailboxFacts:
    """The machine and the mailbox program.

    Attributes:
        version: Of the mailbox, for example ``1.0``.
        kinematics: Name of the kinematics block.
        orientation_kinematics: Name of the one coupled to it, empty for none.
        axis_count: Axes of the group.
        unit_um: Micrometres in a unit of length.
        capabilities: What the program can be told.
        boot_id: Number of the PLC start.
        device_id: Number of the PLC, drawn once; ``None`` where its program has none.
    """

    version: str
    kinematics: str
    orientation_kinematics: str
    axis_count: int
    unit_um: float
    capabilities: Capability
    boot_id: int
    device_id: int | None

    @classmethod
    def of(cls, now: Response, *, device_id: int | None) -> "MailboxFacts":
        """Return the facts in a snapshot."""
        return cls(
            version=f"{now.version >> 8}.{now.version & 0xFF}",
            kinematics=block_name(now.position_kinematics),
            orientation_kinematics=block_name(now.orientation_kinematics),
            axis_count=now.axis_count,
            unit_um=now.unit_um,
            capabilities=now.capabilities,
            boot_id=now.boot_id,
            device_id=device_id,
        )

    def shared(self) -> ControllerFacts:
        """Return the part that all kinds of controllers share."""
        blocks = (self.kinematics, self.orientation_kinematics)
        model = " + ".join(name for name in blocks if name)
        return ControllerFacts(
            controller_type="CODESYS SoftMotion",
            controller_serial=None if self.device_id is None else f"{self.device_id:08X}",
            firmware=tr("mailbox {version}", version=self.version),
            robot_models=(model,) if model else (),
        )


def set_kinematics(mailbox: Mailbox, position: Kinematics, orientation: Kinematics) -> None:
    """Select a kinematics and confirm it; see ``SoftMotionController.set_kinematics``."""
    draft = Command(0, Opcode.SET_KINEMATICS, operands=(position, orientation, 0, 0))
    request, wanted = describe(draft), kinematics_word(position, orientation)
    with mailbox.lock.held(request):
        mailbox.markers.require_settled(request)  # before the mailbox is taken
        now = mailbox.prepare(draft, request)
        require_still(now)
        mailbox.markers.note_selection(0)
        marked = {"kinematics": wanted, "before": now.kinematics}
        after = mailbox.carry_out(MarkedDraft(mailbox, draft, marked, mailbox.snapshots.take))
        mailbox.markers.ledger.saw_selected(after.tool_slot)
    if after.kinematics != wanted or after.tool_slot:
        raise ReadBackError(
            tr(
                "The PLC shows kinematics {found:#06x} and tool {tool} after {request!r}.",
                found=after.kinematics,
                tool=after.tool_slot,
                request=request,
            ),
            remedy=tr("Do not move the robot; compare the mailbox program with its codes."),
            request=request,
        )


def block_name(code: int) -> str:
    """Return the function block of a code; empty for none."""
    try:
        kinematics = Kinematics(code)
    except ValueError:
        return tr("kinematics {code}", code=code)
    return kinematics.block_name or ("" if kinematics is Kinematics.NONE else kinematics.name)


_LOOKS: Final = 20
"""Number of heads read to measure the heartbeat and the answer time."""

_SLOW_S: Final = 0.1
"""Answer time in s above which little is left of the half second between beats."""


@dataclass(frozen=True, slots=True)
class MailboxFinding:
    """One thing about a mailbox.

    Attributes:
        name: What it is about, for a person.
        finding: What was found.
        right: Whether that is as it should be.
        remedy: What to do where it is not.
    """

    name: str
    finding: str
    right: bool = True
    remedy: str = ""


def verify_mailbox(mailbox: Mailbox) -> tuple[MailboxFinding, ...]:
    """Check everything that can be seen without a command; nothing is written.

    That the version, the probe and the heartbeat are right was found on connecting, which would
    have failed otherwise.

    Raises:
        TransportError, RemoteProtocolError: The link failed.
    """
    now = mailbox.snapshots.take()
    facts = MailboxFacts.of(now, device_id=mailbox.device_id)
    return (
        MailboxFinding(tr("mailbox version"), facts.version),
        MailboxFinding(tr("probe"), tr("{value} in its place, low word first", value=f"{PROBE:g}")),
        *_pace(mailbox, now),
        MailboxFinding(tr("PLC start (boot_id)"), str(now.boot_id)),
        _device(mailbox),
        MailboxFinding(tr("unit of length"), tr("{unit:g} micrometres", unit=now.unit_um)),
        _kinematics(facts),
        _opcodes(now),
        _slots(mailbox),
        *_state(now),
    )


def _pace(mailbox: Mailbox, now: Response) -> Iterator[MailboxFinding]:
    """Measure how fast the PLC counts, and how fast it answers."""
    clock, wire = mailbox.wire.clock, mailbox.wire
    begun_ns, count, slowest_s = clock.now_ns(), 0, 0.0
    before = now.plc_heartbeat
    for _ in range(_LOOKS):
        asked_ns = clock.now_ns()
        head = wire.read_head()
        slowest_s = max(slowest_s, (clock.now_ns() - asked_ns) / NS_PER_S)
        count += (head.heartbeat - before) & 0xFFFF
        before = head.heartbeat
    passed_s = (clock.now_ns() - begun_ns) / NS_PER_S
    moves = count > 0
    yield MailboxFinding(
        tr("PLC heartbeat"),
        tr("{count} counts in {passed:.2f} s", count=count, passed=passed_s),
        right=moves,
        remedy="" if moves else tr("The mailbox program is not called in the motion task."),
    )
    quick = slowest_s <= _SLOW_S
    yield MailboxFinding(
        tr("longest answer"),
        tr("{ms:.0f} ms", ms=slowest_s * 1000),
        right=quick,
        remedy=""
        if quick
        else tr("A movement needs a beat every 500 ms: use a faster line or a quieter network."),
    )


def _device(mailbox: Mailbox) -> MailboxFinding:
    if mailbox.device_id is not None:
        return MailboxFinding(tr("PLC number (device_id)"), f"{mailbox.device_id:08X}")
    return MailboxFinding(
        tr("PLC number (device_id)"),
        tr("none: this PLC is known by its address only"),
        right=False,
        remedy=tr("Load the mailbox program of this robolink: it gives itself a number."),
    )


def _kinematics(facts: MailboxFacts) -> MailboxFinding:
    models = facts.shared().robot_models
    return MailboxFinding(
        tr("kinematics"),
        models[0] if models else tr("none"),
        right=bool(models),
        remedy="" if models else tr("No tool can be set before the PLC's program sets one."),
    )


def _opcodes(now: Response) -> MailboxFinding:
    able = [code for code, facts in OPCODES.items() if facts.capability in now.capabilities]
    moves = Opcode.MOVE_LINEAR in able
    return MailboxFinding(
        tr("opcodes"),
        tr("{count}, with motion", count=len(able))
        if moves
        else tr("{count}, without motion", count=len(able)),
    )


def _slots(mailbox: Mailbox) -> MailboxFinding:
    """Read every slot; one whose two ends or checksum do not fit is read three times."""
    defined, broken = [], []
    for number in SLOTS:
        try:
            slot = mailbox.snapshots.slot(number, keep=True)
        except RemoteProtocolError:
            broken.append(number)
            continue
        if of_no_tool(slot.tool):
            broken.append(number)
        elif slot.defined:
            defined.append(number)
    if broken:
        return MailboxFinding(
            tr("tool slots"),
            tr("these cannot be used: {slots}", slots=", ".join(map(str, broken))),
            right=False,
            remedy=tr(
                "Compare the PLC's register map and its checksum (docs/reference/mailbox.md)."
            ),
        )
    return MailboxFinding(
        tr("tool slots"),
        tr(
            "{count} whole, checksums right; defined: {slots}",
            count=len(SLOTS),
            slots=", ".join(map(str, defined)) or tr("none"),
        ),
    )


def _state(now: Response) -> Iterator[MailboxFinding]:
    permitted = bool(now.bits & Bits.PERMITTED)
    yield MailboxFinding(
        tr("permit (xPermit)"),
        tr("given: changes are allowed now") if permitted else tr("not given: reading only"),
    )
    yield MailboxFinding(
        tr("owner"), tr("a client has it") if now.bits & Bits.OWNED else tr("nobody")
    )
    states: dict[int, str] = {
        GroupState.DISABLED: tr("disabled"),
        GroupState.STANDBY: tr("standby"),
        GroupState.MOVING: tr("moving"),
        GroupState.HOMING: tr("homing"),
        GroupState.STOPPING: tr("held by a stop"),
        GroupState.ERRORSTOP: tr("in error"),
    }
    powered = tr("with power") if now.bits & Bits.POWERED else tr("without power")
    state = states.get(now.group_state, str(int(now.group_state)))
    yield MailboxFinding(tr("axis group"), f"{state}, {powered}")
    yield MailboxFinding(tr("selected tool"), str(now.tool_slot) if now.tool_slot else tr("none"))
    damaged = now.rejected == 0
    yield MailboxFinding(
        tr("damaged command blocks"),
        str(now.rejected),
        right=damaged,
        remedy=""
        if damaged
        else tr("The PLC has refused this many since its start: look for a gateway or a bad line."),
    )
