"""The tool that an axis group itself works with, as the proof of a write or a selection.

A slot of the mailbox program may hold one tool while the group works with another one
(docs/reference/faults.md F43, F44). What is selected counts as changed only when the group's own
tool was read too.
"""

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
        """Read it; see ``SoftMotionToolTable.read_mode``."""
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
