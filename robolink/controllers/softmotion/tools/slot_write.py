"""The tool that an axis group itself works with, as the proof of a write or a selection.

A slot of the mailbox program may hold one tool while the group works with another one
(docs/reference/faults.md F43, F44). What is selected counts as changed only when the group's own
tool was read too.
"""

from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import ReadBackError, RejectedError
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt, describe_offset
from robolink.protocols.mailbox import Command, ErrorClass, Opcode, ReadMode


class GroupTool:
    """The tool of the axis group behind a mailbox (SMC_GroupReadTool); needs the ownership."""

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox

    def read(self, mode: ReadMode = ReadMode.SET) -> ToolOffset | None:
        """Read it; see :meth:`SoftMotionToolTable.read_mode`."""
        draft = Command(0, Opcode.READ_TOOL, operands=(mode, 0, 0, 0))
        try:
            now = self._mailbox.commands.carry_out(draft)
        except RejectedError as error:
            if error.code == ErrorClass.NO_SUCH_MOVEMENT:
                return None
            raise
        return self._mailbox.from_plc(now.answer.pose)

    def require(self, offset: ToolOffset | None, request: str) -> None:
        """Prove that the group works with ``offset``.

        Raises:
            ReadBackError: It works with another tool.
        """
        found = self.read()
        if not self._mailbox.same(found, offset):
            raise self.differs(offset, found, request)

    def differs(
        self, offset: ToolOffset | None, found: ToolOffset | None, request: str
    ) -> ReadBackError:
        """Return the error for a group that works with another tool than its slot holds."""
        return ReadBackError(
            tr(
                "The slot holds {offset}, but the axis group works with {found}.",
                offset=describe_offset(offset),
                found=describe_offset(found),
            ),
            remedy=tr("Do not move the robot; another program may set the group's tool."),
            controller=self._mailbox.identity,
            request=request,
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
        self._found: ToolOffset | None = None
        self._group_differs = False

    def change(self, expected: Expected) -> ToolReceipt:
        """Write and read back; see :class:`robolink.controllers.tool_writing.ToolWrite`."""
        try:
            return super().change(expected)
        except ReadBackError as error:
            if self._group_differs and self._group_tool is not None:
                differs = self._group_tool.differs(self.requested, self._found, self.request)
                raise differs from error
            raise

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
        """Return what is stored, or what the group works with where that differs."""
        self._found, group_tool = self._slot(), self._group_tool
        if group_tool is not None and self._mailbox.same(self._found, self.requested):
            self._found = group_tool.read()
            self._group_differs = not self._mailbox.same(self._found, self.requested)
        return self._found

    def _slot(self) -> ToolOffset | None:
        mailbox = self._mailbox
        found = mailbox.tool_in(mailbox.snapshots.slot(self.tool))
        mailbox.markers.ledger.saw_tool(self.tool, found)
        return found
