"""The tool slots of a PLC mailbox: fifteen that are retained, and the selected one.

SoftMotion has no table of its own (docs/reference/softmotion.md 3.3): the mailbox program keeps the
slots, and selecting one, or writing the selected one, calls SMC_GroupSetTool
(docs/reference/rules.md 2).

One write of a slot, read back from all that it changes.

Settles what an earlier process left open on a PLC behind a mailbox.

The tool that an axis group itself works with, as the proof of a write or a selection.

A slot of the mailbox program may hold one tool while the group works with another one
(docs/reference/faults.md F43, F44). What is selected counts as changed only when the group's own
tool was read too.
"""

from collections.abc import Sequence
from dataclasses import replace

from robolink.controllers.preserving import Preserver
from robolink.controllers.resolving import MarkerResolver
from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.condition import (
    is_tool_known,
    require_enabled,
    require_still,
)
from robolink.controllers.softmotion.kinematics import (
    OrientationImages,
    require_fit,
    require_measurable,
)
from robolink.controllers.softmotion.mailbox import Mailbox
from robolink.controllers.tool_table import ToolTableCore, require_replacement
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import ReadBackError, RejectedError
from robolink.messages import tr
from robolink.model import (
    Expected,
    Finding,
    Marker,
    ToolOffset,
    ToolReceipt,
    Verdict,
    describe_offset,
)
from robolink.protocols.mailbox import SLOTS, Command, ErrorClass, Opcode, ReadMode, Response, Slot


class GroupTool:
    """The tool of the axis group behind a mailbox (SMC_GroupReadTool); needs the ownership."""

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox

    def read(self, mode: ReadMode = ReadMode.SET) -> ToolOffset | None:
        """Read it; see ``SoftMotionToolTable.read_mode``."""
        draft = Command(0, Opcode.READ_TOOL, operands=(mode, 0, 0, 0))
        try:
            now = self._mailbox.commands.carry_out(draft)
        except RejectedError as error:
            if error.code == ErrorClass.NO_SUCH_MOVEMENT:
                return None
            raise
        return self._mailbox.from_plc(now.answer.pose)

    def require(self, offset: ToolOffset | None) -> None:
        """Confirm that the group works with ``offset``.

        Raises:
            ReadBackError: It works with another tool.
        """
        found = self.read()
        if not self._mailbox.same(found, offset):
            raise self.differs(offset, found)

    def differs(self, offset: ToolOffset | None, found: ToolOffset | None) -> ReadBackError:
        """Return the error for a group that works with another tool than its slot holds."""
        return ReadBackError(
            tr(
                "The slot holds {offset}, but the axis group works with {found}.",
                offset=describe_offset(offset),
                found=describe_offset(found),
            ),
            remedy=tr("Do not move the robot; another program may set the group's tool."),
        )


class SlotWrite(ToolWrite):
    """Opcode 5205 or 30003 for one slot, read back from all that it changes.

    Args:
        mailbox: The mailbox.
        tool: Number of the slot.
        requested: What it is to hold; ``None`` empties it.
        draft: The command.
        stored: What the slot holds, where it was read after the mailbox was ours.
        group_tool: The group's own tool; ``None`` where another slot is selected.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        tool: int,
        requested: ToolOffset | None,
        draft: Command,
        *,
        stored: tuple[ToolOffset | None] | None,
        group_tool: GroupTool | None,
    ) -> None:
        super().__init__(mailbox, tool, requested, describe(draft), same=mailbox.same)
        self._mailbox = mailbox
        self._draft = draft
        self._stored = stored
        self._group_tool = group_tool
        self._group_differs = False

    def read_before(self, expected: Expected) -> ToolOffset | None:  # noqa: ARG002 - one way only
        """Read what the write replaces.

        What was read before the mailbox was ours is read again: until then its owner may have
        changed it.
        """
        return self._slot() if self._stored is None else self._stored[0]

    def send(self) -> None:
        """Send the command, once."""
        self._mailbox.commands.carry_out(self._draft)

    def read_back(self) -> ToolOffset | None:
        """Return what is stored, or what the group works with if that differs."""
        found, group_tool = self._slot(), self._group_tool
        if group_tool is not None and self._mailbox.same(found, self.requested):
            found = group_tool.read()
            self._group_differs = not self._mailbox.same(found, self.requested)
        return found

    def _differs(self, found: ToolOffset | None) -> ReadBackError:
        if self._group_differs and self._group_tool is not None:
            return self._group_tool.differs(self.requested, found)
        return super()._differs(found)

    def _slot(self) -> ToolOffset | None:
        mailbox = self._mailbox
        found = mailbox.tool_in(mailbox.snapshots.slot(self.tool))
        mailbox.markers.ledger.saw_tool(self.tool, found)
        return found


class SoftMotionToolTable(ToolTableCore):
    """Slots 1 to 15; reading them needs no ownership.

    Every write is compare-and-set and read back, from the slot and, for the selected one, from
    the axis group too.
    """

    def __init__(self, mailbox: Mailbox, images: OrientationImages | None = None) -> None:
        super().__init__(mailbox)
        self._mailbox = mailbox
        self._images = images or OrientationImages()
        self._group_tool = GroupTool(mailbox)

    def indices(self) -> Sequence[int]:
        """Return 1 to 15; tool 0 is the flange."""
        return SLOTS

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether the PLC stores both alike: 1e-9, rotations as matrices."""
        return self._mailbox.same(a, b)

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read every slot, with one check of the word order for all of them."""
        found = {
            tool: self._mailbox.tool_in(slot)
            for tool, slot in self._mailbox.snapshots.slots(SLOTS).items()
        }
        for tool, offset in found.items():
            self._mailbox.markers.ledger.saw_tool(tool, offset)
        return found

    def name(self, tool: int) -> str:
        """Read the name of a slot, empty when it has none."""
        self.require_writable(tool)
        return self._mailbox.snapshots.slot(tool).name

    def read_mode(self, mode: ReadMode) -> ToolOffset | None:
        """Read a tool of the axis group itself (SMC_GroupReadTool); needs the ownership.

        Args:
            mode: The tool set now, of the movement that runs or was interrupted, or of the one
                commanded last.

        Returns:
            ``None`` when there is no such movement.
        """
        return self._group_tool.read(mode)

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        mailbox, draft = self._mailbox, self._draft(tool, requested)
        request = describe(draft)
        with mailbox.lock.held(request):
            owned = bool(mailbox.wire.epoch)
            slot = mailbox.snapshots.slot(tool)
            stored = mailbox.tool_in(slot)
            now = mailbox.snapshots.latest
            require_still(now)
            in_force = now.tool_slot == tool
            if not self.same(stored, requested):
                if in_force:
                    self._require_changeable(tool, requested, now)
                self._require_carried(requested, now)
                mailbox.prepare(draft, request, now=now)
            return SlotWrite(
                mailbox,
                tool,
                requested,
                draft if requested is None else replace(draft, name=_name(tool, slot)),
                stored=(stored,) if owned else None,
                group_tool=self._group_tool if in_force else None,
            ).change(expected)

    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        return describe(self._draft(tool, requested))

    def _draft(self, tool: int, requested: ToolOffset | None) -> Command:
        operands = (tool, 0, 0, 0)
        if requested is None:
            return Command(0, Opcode.CLEAR_TOOL, operands=operands)
        pose = self._mailbox.to_plc(requested)
        return Command(0, Opcode.WRITE_TOOL, operands=operands, pose=pose)

    def _stored(self, tool: int) -> ToolOffset | None:
        return self._mailbox.tool_in(self._mailbox.snapshots.slot(tool))

    def _selected(self) -> int:
        return self._mailbox.snapshots.take().tool_slot

    def _is_in_force(self, tool: int) -> bool:
        now = self._mailbox.snapshots.take()
        return now.tool_slot == tool and is_tool_known(now)

    def _select_request(self, tool: int) -> str:
        return describe(_select_draft(tool))

    def _send_selection(self, tool: int) -> None:
        self._mailbox.commands.carry_out(_select_draft(tool))

    def _prepare_selection(self, tool: int, request: str) -> None:
        mailbox = self._mailbox
        now = mailbox.prepare(_select_draft(tool), request)
        require_still(now)
        require_enabled(now)
        self._require_carried(self._stored(tool) if tool else None, now)

    def _require_possible(self, tool: int, offset: ToolOffset) -> None:  # noqa: ARG002 - alike
        self._require_carried(offset, self._mailbox.snapshots.take())

    def require_measurable(self, components: Sequence[str]) -> None:
        """Refuse to measure what this kinematics cannot accept; see the model."""
        require_measurable(self._images, self._mailbox.snapshots.take(), components)

    def _require_carried(self, offset: ToolOffset | None, now: Response) -> None:
        """Refuse what the kinematics cannot carry, unless it is being restored."""
        if offset is not None and not self._mailbox.latch.restores:
            require_fit(self._images, now, offset)

    def _prove_selected(self, offset: ToolOffset, request: str) -> None:  # noqa: ARG002 - alike
        self._group_tool.require(offset)

    def _known(self, lowest: int) -> str:
        return tr("Choose a tool from {lowest} to 15.", lowest=lowest)

    def _require_changeable(self, tool: int, requested: ToolOffset | None, now: Response) -> None:
        """Refuse what the PLC would refuse for the selected slot."""
        if requested is None:
            require_replacement(tool, None)
        require_enabled(now)


def _name(tool: int, slot: Slot) -> str:
    """Return the name that a slot keeps, or gets when it has none that can be written."""
    name = slot.name
    return name if name and name.isascii() and name.isprintable() else f"Tool {tool}"


def _select_draft(tool: int) -> Command:
    return Command(0, Opcode.SELECT_TOOL, operands=(tool, 0, 0, 0))


class SoftMotionResolver(MarkerResolver):
    """Examines and recovers the open markers that this driver begins."""

    def __init__(self, mailbox: Mailbox, tools: SoftMotionToolTable, preserver: Preserver) -> None:
        super().__init__(mailbox, tools, preserver)
        self._mailbox = mailbox

    def fence(self) -> None:
        """Take the mailbox: a block in progress belongs to an earlier epoch."""
        self._mailbox.commands.ownership.fence()

    def _require_rest(self) -> None:
        with self._mailbox.asked(tr("recover")):
            require_still(self._mailbox.snapshots.take())

    def _examine_more(self, marker: Marker) -> Finding | None:
        if "kinematics" in marker.details:
            return self._examine_kinematics(marker)
        return _examine_output(marker) if "output" in marker.details else None

    def _examine_kinematics(self, marker: Marker) -> Finding:
        now = self._mailbox.snapshots.take().kinematics
        done = now == marker.details["kinematics"]
        sentence = tr("Kinematics {now:#06x} is in force now.", now=now)
        return Finding(marker, Verdict.DONE if done else Verdict.NOT_APPLIED, sentence)


def _examine_output(marker: Marker) -> Finding:
    sentence = tr(
        "A PLC's output cannot be read through the mailbox: check the effect of "
        "{request!r} at the machine.",
        request=marker.request,
    )
    return Finding(marker, Verdict.LOOK, sentence)
