"""What the mailbox program gives out: the response block and the tool slots.

Source: docs/reference/mailbox.md.
"""

from dataclasses import replace
from typing import Any, Final

from robolink.protocols.mailbox import (
    DEVICE,
    DEVICE_WORDS,
    RESPONSE,
    SLOT,
    SLOTS,
    VERSION,
    Bits,
    CommandState,
    ErrorClass,
    GroupState,
    Response,
    WordOrder,
    Words,
    encode_device_id,
    encode_response,
    encode_slot,
)
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import GroupStatus
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef, CoordSystem
from robolink_simulators.softmotion.mailbox.image import UserUnits, arranged
from robolink_simulators.softmotion.mailbox.jobs import Job
from robolink_simulators.softmotion.mailbox.program import MailboxProgram
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.softmotion.mailbox.tool_commands import ToolDesk

HEAD: Final = RESPONSE.before("boot_id")
"""The start of the response block, which shows the progress of a command."""

# Plain numbers: every answer reads them, and adding enumeration members is slow.
_BITS: Final = tuple(
    bit.value
    for bit in (
        Bits.POWERED,
        Bits.TOOL_KNOWN,
        Bits.BUSY,
        Bits.JOGGING,
        Bits.SIMULATED,
        Bits.OWNED,
        Bits.INTERRUPTED,
        Bits.PERMITTED,
    )
)


class Outbox:
    """Composes the words that clients read.

    Args:
        group: The axis group.
        memory: The retained variables.
        tools: Knows slot and kinematics.
        units: Of the mailbox.
        order: How the program lays values of several words.
        identified: Whether it gives out the PLC's own number.
    """

    def __init__(
        self,
        group: AxisGroup,
        memory: RetainedMemory,
        tools: ToolDesk,
        units: UserUnits,
        *,
        order: WordOrder,
        identified: bool,
    ) -> None:
        self._group = group
        self._memory = memory
        self._tools = tools
        self._units = units
        self._order = order
        self._identified = identified

    def lay_words(self, order: WordOrder) -> None:
        """Lay values of several words in another order from now on."""
        self._order = order

    def words(self, program: MailboxProgram, heartbeat: int) -> Words:
        """Return response, slots and device block, one behind the other."""
        response = self.response(program, heartbeat)
        slots = (word for number in SLOTS for word in self.slot(number))
        return (*response, *slots, *self.device())

    def response(self, program: MailboxProgram, heartbeat: int) -> Words:
        """Return the response block."""
        told = replace(
            self._without_position(program, heartbeat),
            tcp=self._units.given(
                CoordRef(*self._group.read_actual_position(CoordSystem.MCS).values)
            ),
            axes=self._units.given_axes(self._group.values, self._group.kinematics.kinds),
        )
        return arranged(RESPONSE, encode_response(told), self._order)

    def head(self, program: MailboxProgram, heartbeat: int) -> Words:
        """Return the words before ``boot_id``: clients read these all the time."""
        told = self._told_of_command(program)
        told |= {"version": VERSION, "plc_heartbeat": heartbeat}
        return arranged(HEAD, HEAD.pack(told), self._order)

    def slot(self, number: int) -> Words:
        """Return a tool slot."""
        return arranged(SLOT, encode_slot(self._memory.slot(number)), self._order)

    def device(self) -> Words:
        """Return the device block; zeros where the program has none."""
        if not self._identified:
            return (0,) * DEVICE_WORDS
        return arranged(DEVICE, encode_device_id(self._memory.device_id), self._order)

    def _without_position(self, program: MailboxProgram, heartbeat: int) -> Response:
        group, jobs = self._group, program.jobs
        job = jobs.acknowledged
        return Response(
            **self._told_of_command(program),
            plc_heartbeat=heartbeat,
            boot_id=self._memory.boot_id,
            tool_slot=self._tools.selected,
            answer=program.answer,
            kinematics=self._tools.kinematics_code,
            axis_count=len(group.kinematics.kinds),
            capabilities=program.capabilities,
            unit_um=self._units.unit_um,
            rejected=program.inbox.rejected,
            active_movement=jobs.active_movement,
            queue_length=len(jobs.movements),
            finished=jobs.ends,
            ack_owner=job.command.owner if job else 0,
        )

    def _told_of_command(self, program: MailboxProgram) -> dict[str, Any]:
        """Return how the acknowledged command and the group are, by field."""
        job, status = program.jobs.acknowledged, self._group.status()
        return {
            "ack_head": job.command.sequence if job else 0,
            "state": job.state if job else CommandState.EMPTY,
            "error_class": job.error_class if job else ErrorClass.NONE,
            "raw_error": _raw_error(job, status),
            "opcode_echo": job.command.opcode if job else 0,
            "group_state": GroupState(self._group.state.value),
            "bits": self._bits(program, status),
        }

    def _bits(self, program: MailboxProgram, status: GroupStatus) -> Bits:
        job = program.jobs.acknowledged
        shown = (
            status.powered,
            self._tools.tool_known,
            job is not None and not job.state.final,
            status.jogging,
            True,
            program.ownership.holder != 0,
            status.interrupted_movement != 0,
            program.permitted,
        )
        return Bits(sum(bit for bit, on in zip(_BITS, shown, strict=True) if on))


def _raw_error(job: Job | None, status: GroupStatus) -> int:
    """Return the ErrorID of the block, or of the group where the block shows no error.

    The two are never mixed (docs/reference/mailbox.md, "Errors"): a block in error whose number
    nobody knows shows 0, whatever the group shows beside it.
    """
    if job is not None and job.error_class:
        return job.raw
    return status.error.number if status.error else 0
