"""One write of a slot, read back from all that it changes."""

from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.tools.group_tool import GroupTool
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import ReadBackError
from robolink.model import Expected, ToolOffset, ToolReceipt
from robolink.protocols.mailbox import Command


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
