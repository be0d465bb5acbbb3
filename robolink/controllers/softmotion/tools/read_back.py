"""The tool that an axis group itself works with, as the proof of a write or a selection.

A slot of the mailbox program may hold one tool while the group works with another one
(docs/reference/faults.md F43, F44). What is selected counts as changed only when the group's own
tool was read too.
"""

from collections.abc import Callable

from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.errors import ReadBackError, RejectedError
from robolink.messages import tr
from robolink.model import ToolOffset, describe_offset
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

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Tell whether the PLC holds both alike."""
        return self._mailbox.same(a, b)

    def require(self, offset: ToolOffset | None, request: str) -> None:
        """Prove that the group works with ``offset``.

        Raises:
            ReadBackError: It works with another tool.
        """
        found = self.read()
        if not self.same(found, offset):
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


class SlotReadBack:
    """Reads a write back: the slot and, where it is the selected one, the group's own tool.

    Args:
        read_slot: Reads the slot.
        group_tool: The group's own tool; ``None`` where another slot is selected.
        requested: What was written.

    Attributes:
        found: What was read last.
        group_differs: Whether the slot is as requested and the group's own tool is not.
    """

    def __init__(
        self,
        read_slot: Callable[[], ToolOffset | None],
        group_tool: GroupTool | None,
        requested: ToolOffset | None,
    ) -> None:
        self._read_slot = read_slot
        self._group_tool = group_tool
        self._requested = requested
        self.found: ToolOffset | None = None
        self.group_differs = False

    def read(self) -> ToolOffset | None:
        """Return what is stored, or what the group works with where that differs."""
        self.found, group_tool = self._read_slot(), self._group_tool
        if group_tool is not None and group_tool.same(self.found, self._requested):
            self.found = group_tool.read()
            self.group_differs = not group_tool.same(self.found, self._requested)
        return self.found
