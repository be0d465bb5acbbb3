"""The tool slots of a PLC mailbox: fifteen that are retained, and the selected one.

SoftMotion has no table of its own (docs/reference/softmotion.md 3.3): the mailbox program keeps the
slots, and selecting one, or writing the selected one, calls SMC_GroupSetTool
(docs/reference/rules.md 2).
"""

from collections.abc import Sequence
from dataclasses import replace

from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.condition import (
    is_tool_known,
    require_enabled,
    require_still,
)
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.tools.compatibility import require_fit, require_measurable
from robolink.controllers.softmotion.tools.group_tool import GroupTool
from robolink.controllers.softmotion.tools.orientation_images import OrientationImages
from robolink.controllers.softmotion.tools.slot_write import SlotWrite
from robolink.controllers.tool_table import ToolTableCore, require_replacement
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt
from robolink.protocols.mailbox import SLOTS, Command, Opcode, ReadMode, Response, Slot


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
        """Tell whether the PLC holds both alike: 1e-9, rotations as matrices."""
        return self._mailbox.same(a, b)

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
            now = mailbox.snapshots.take()
            require_still(now, controller=mailbox.identity, request=request)
            in_force = now.tool_slot == tool
            if not self.same(stored, requested):
                if in_force:
                    self._require_changeable(tool, requested, now, request)
                self._require_carried(requested, now, request)
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
        require_still(now, controller=mailbox.identity, request=request)
        require_enabled(now, controller=mailbox.identity, request=request)
        self._require_carried(self._stored(tool) if tool else None, now, request)

    def _require_possible(self, tool: int, offset: ToolOffset) -> None:
        now = self._mailbox.snapshots.take()
        self._require_carried(offset, now, self._request(tool, offset))

    def require_measurable(self, components: Sequence[str]) -> None:
        """Refuse to measure what this kinematics could not be told; see the model."""
        mailbox, now = self._mailbox, self._mailbox.snapshots.take()
        require_measurable(self._images, now, components, controller=mailbox.identity)

    def _require_carried(self, offset: ToolOffset | None, now: Response, request: str) -> None:
        """Refuse what the kinematics cannot carry, unless it is put back."""
        mailbox = self._mailbox
        if offset is not None and not mailbox.latch.restores:
            require_fit(self._images, now, offset, controller=mailbox.identity, request=request)

    def _prove_selected(self, offset: ToolOffset, request: str) -> None:
        self._group_tool.require(offset, request)

    def _known(self, lowest: int) -> str:  # noqa: ARG002 - alike for both
        return tr("The mailbox has tools 0 to 15.")

    def _require_changeable(
        self, tool: int, requested: ToolOffset | None, now: Response, request: str
    ) -> None:
        """Hold back what the PLC would refuse for the slot in force."""
        if requested is None:
            require_replacement(tool, None)
        require_enabled(now, controller=self._mailbox.identity, request=request)


def _name(tool: int, slot: Slot) -> str:
    """Return the name that a slot keeps, or gets when it has none that can be written."""
    name = slot.name
    return name if name and name.isascii() and name.isprintable() else f"Tool {tool}"


def _select_draft(tool: int) -> Command:
    return Command(0, Opcode.SELECT_TOOL, operands=(tool, 0, 0, 0))
