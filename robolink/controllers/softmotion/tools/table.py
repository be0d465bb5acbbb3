"""The tool slots of a PLC mailbox: fifteen that are retained, and the selected one.

SoftMotion has no table of its own (docs/reference/softmotion.md 3.3): the mailbox program keeps the
slots, and selecting one, or writing the selected one, calls SMC_GroupSetTool
(docs/reference/rules.md 2).
"""

from collections.abc import Sequence
from dataclasses import replace

from robolink.controllers.softmotion.link.answers import describe
from robolink.controllers.softmotion.link.condition import require_enabled, require_still
from robolink.controllers.softmotion.link.mailbox import Mailbox
from robolink.controllers.softmotion.tools.read_back import GroupTool, SlotReadBack
from robolink.controllers.tool_clearing import (
    clear_after_selecting,
    preview_clearing,
    require_replacement,
)
from robolink.controllers.tool_writing import ToolWrite
from robolink.errors import (
    ReadBackError,
    ReservedToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt
from robolink.protocols.mailbox import (
    SLOTS,
    Command,
    Opcode,
    ReadMode,
    Response,
    Slot,
)


class SoftMotionToolTable:
    """Slots 1 to 15; reading them needs no ownership.

    Every write is compare-and-set and read back, from the slot and, for the selected one, from
    the axis group too.
    """

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox
        self._group_tool = GroupTool(mailbox)

    def indices(self) -> Sequence[int]:
        """Return 1 to 15; tool 0 is the flange."""
        return SLOTS

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Tell whether the PLC holds both alike: 1e-9, rotations as matrices."""
        return self._mailbox.same(a, b)

    def require_writable(self, tool: int) -> None:
        """Refuse a slot number that cannot be written; sends nothing.

        Raises:
            ReservedToolError, ToolIndexError: As :meth:`write` would.
        """
        if tool == 0:
            raise ReservedToolError(
                tr("Tool 0 is the flange itself and is never written."),
                remedy=tr("Choose a tool from 1 to 15."),
            )
        self._check_index(tool)

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read all fifteen slots."""
        return {tool: self.read(tool) for tool in self.indices()}

    def read(self, tool: int) -> ToolOffset | None:
        """Read one slot, ``None`` when it is empty; tool 0 reads as all zeros."""
        self._check_index(tool)
        if tool == 0:
            return ToolOffset()
        found = self._value(self._mailbox.snapshots.slot(tool))
        self._mailbox.markers.ledger.saw_tool(tool, found)
        return found

    def name(self, tool: int) -> str:
        """Read the name of a slot, empty when it has none."""
        self.require_writable(tool)
        return self._mailbox.snapshots.slot(tool).name

    def read_mode(self, mode: ReadMode) -> ToolOffset | None:
        """Read a tool of the axis group itself (SMC_GroupReadTool); needs the ownership.

        Args:
            mode: The tool set now, of the movement that runs, or of the one commanded last.

        Returns:
            ``None`` when there is no such movement.
        """
        return self._group_tool.read(mode)

    def write(self, tool: int, offset: ToolOffset, *, expected: Expected) -> ToolReceipt:
        """Write and read back; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        return self._set(tool, offset, expected, self._write_draft(tool, offset))

    def clear(
        self, tool: int, *, expected: Expected, then_select: int | None = None
    ) -> ToolReceipt:
        """Empty a slot that is not selected; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        with self._mailbox.lock.held(describe(_clear_draft(tool))):
            return clear_after_selecting(
                self,
                tool,
                lambda: self._set(tool, None, expected, _clear_draft(tool)),
                expected=expected,
                then_select=then_select,
                uninterrupted=self._mailbox.uninterrupted,
            )

    def preview_write(self, tool: int, offset: ToolOffset) -> tuple[str, ...]:
        """Return what :meth:`write` would send, in words; reads only.

        Empty when the value is stored already.
        """
        self.require_writable(tool)
        if self.same(self.read(tool), offset):
            return ()
        return (describe(self._write_draft(tool, offset)),)

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send, in words."""
        self.require_writable(tool)
        requests = () if self.read(tool) is None else (describe(_clear_draft(tool)),)
        return preview_clearing(self, tool, requests, then_select)

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Return what :meth:`select` would send, in words."""
        self._require_defined(tool)
        return () if self.selected() == tool else (describe(_select_draft(tool)),)

    def selected(self) -> int:
        """Read which slot is in force; after a PLC start and a new kinematics it is 0."""
        found = self._mailbox.snapshots.take().tool_slot
        self._mailbox.markers.ledger.saw_selected(found)
        return found

    def select(self, tool: int) -> None:
        """Put a slot in force, and prove it by the slot number and the group's own tool."""
        self._check_index(tool)
        draft = _select_draft(tool)
        request = describe(draft)
        mailbox = self._mailbox
        with mailbox.lock.held(request):
            before = self.selected()
            if before == tool:
                return
            offset = self._require_defined(tool)
            now = mailbox.prepare(draft, request)
            require_still(now, controller=mailbox.identity, request=request)
            require_enabled(now, controller=mailbox.identity, request=request)
            details = {"select": tool, "before": before}

            def send() -> None:
                mailbox.commands.carry_out(draft)
                mailbox.markers.note_selection(tool)

            found = mailbox.writer.carry_out(request, details, send=send, read=self.selected)
            if found != tool:
                raise ReadBackError(
                    tr(
                        "Tool {tool} was selected, but the PLC says that tool {found} is in force.",
                        tool=tool,
                        found=found,
                    ),
                    remedy=tr("Do not move the robot; look at the PLC's tool selection."),
                    request=request,
                )
            self._group_tool.require(offset, request)

    def _set(
        self, tool: int, requested: ToolOffset | None, expected: Expected, draft: Command
    ) -> ToolReceipt:
        mailbox, request = self._mailbox, describe(draft)
        with mailbox.lock.held(request):
            # What is read before the mailbox is ours may be changed by its owner until then.
            owned = bool(mailbox.wire.epoch)
            slot = mailbox.snapshots.slot(tool)
            stored = self._value(slot)
            now = mailbox.snapshots.take()
            require_still(now, controller=mailbox.identity, request=request)
            in_force = now.tool_slot == tool
            if not self.same(stored, requested):
                if in_force:
                    self._require_changeable(tool, requested, now, request)
                mailbox.prepare(draft, request, now=now)
            named = draft if requested is None else replace(draft, name=_name(tool, slot))
            proof = SlotReadBack(
                lambda: self.read(tool), self._group_tool if in_force else None, requested
            )
            write = ToolWrite(
                tool,
                requested,
                request,
                send=lambda: mailbox.commands.carry_out(named),
                read=lambda: stored if owned else self.read(tool),
                read_back=proof.read,
            )
            try:
                return mailbox.writer.change(write, expected)
            except ReadBackError as error:
                if proof.group_differs:
                    raise self._group_tool.differs(requested, proof.found, request) from error
                raise

    def _value(self, slot: Slot) -> ToolOffset | None:
        return self._mailbox.from_plc(slot.tool) if slot.defined else None

    def _write_draft(self, tool: int, offset: ToolOffset) -> Command:
        pose = self._mailbox.to_plc(offset)
        return Command(0, Opcode.WRITE_TOOL, operands=(tool, 0, 0, 0), pose=pose)

    def _require_changeable(
        self, tool: int, requested: ToolOffset | None, now: Response, request: str
    ) -> None:
        """Hold back what the PLC would refuse for the slot in force."""
        if requested is None:
            require_replacement(tool, None)
        require_enabled(now, controller=self._mailbox.identity, request=request)

    def _require_defined(self, tool: int) -> ToolOffset:
        offset = self.read(tool)
        if offset is None:
            raise UndefinedToolError(
                tr("Tool {tool} is not defined, so it was not selected.", tool=tool),
                remedy=tr("Define it first, with a calibration or 'robolink tool set'."),
                request=describe(_select_draft(tool)),
            )
        return offset

    def _check_index(self, tool: int) -> None:
        if isinstance(tool, bool) or not isinstance(tool, int) or not 0 <= tool <= SLOTS[-1]:
            raise ToolIndexError(
                tr("There is no tool {tool}.", tool=tool),
                remedy=tr("The mailbox has tools 0 to 15."),
            )


def _name(tool: int, slot: Slot) -> str:
    """Return the name that a slot keeps, or gets when it has none that can be written."""
    name = slot.name
    return name if name and name.isascii() and name.isprintable() else f"Tool {tool}"


def _clear_draft(tool: int) -> Command:
    return Command(0, Opcode.CLEAR_TOOL, operands=(tool, 0, 0, 0))


def _select_draft(tool: int) -> Command:
    return Command(0, Opcode.SELECT_TOOL, operands=(tool, 0, 0, 0))
