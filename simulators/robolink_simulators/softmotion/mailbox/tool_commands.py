"""The opcodes about tools and kinematics (docs/reference/mailbox.md, "Tools")."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from robolink.errors import ConfigError
from robolink.protocols.mailbox import (
    Answer,
    Command,
    ErrorClass,
    Kinematics,
    Opcode,
    Six,
    find_kinematics,
    kinematics_word,
)
from robolink_simulators.softmotion.catalogue import (
    NAMES,
    machine_named,
    parameter_names,
)
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import ReadToolMode
from robolink_simulators.softmotion.group.movement import ToolInForce
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef, KinematicsModel
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.mailbox.jobs import (
    CommandResult,
    Handler,
    Rejected,
    class_of,
    ok,
    require_finite,
    require_operand,
    require_slot,
)
from robolink_simulators.softmotion.mailbox.retained import RetainedMemory
from robolink_simulators.softmotion.smc_errors import BlockRefused

_NO_TOOL: Final[Six] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_COUPLING: Final = "+"
_LONGEST_MM: Final = 10_000.0
"""Longest tool in mm. A longer one is an input error (docs/reference/mailbox.md, "Tools")."""


class ToolDesk:
    """Keeps the slots and calls the tool blocks.

    Args:
        group: The axis group.
        memory: Keeps the slots.
        units: Of the mailbox.
        parameters: Of the machine, by the names of its kinematics.

    Attributes:
        selected: The slot that was selected last, 0 for none.
        opcodes: What it can do.
    """

    def __init__(
        self,
        group: AxisGroup,
        memory: RetainedMemory,
        units: UserUnits,
        parameters: Mapping[str, float],
    ) -> None:
        self._group = group
        self._memory = memory
        self._units = units
        self._parameters = parameters
        self._applied = group.tool
        self.selected = 0
        self._built_in = (self.kinematics_code, group.kinematics)
        self.opcodes: Mapping[int, Handler] = MappingProxyType(
            {
                Opcode.WRITE_TOOL: self._write,
                Opcode.SELECT_TOOL: self._select,
                Opcode.READ_TOOL: self._read,
                Opcode.CLEAR_TOOL: self._clear,
                Opcode.SET_KINEMATICS: self._set_kinematics,
            }
        )

    @property
    def tool_known(self) -> bool:
        """Whether the tool that is set is the one that the mailbox has set."""
        return self._group.tool is self._applied

    @property
    def kinematics_code(self) -> int:
        """The word that names the kinematics."""
        position, _, orientation = self._group.kinematics.name.partition(_COUPLING)
        return kinematics_word(_code(position), _code(orientation) if orientation else 0)

    def forget(self) -> None:
        """Forget the tool: the group has none any more."""
        self.selected = 0
        self._applied = self._group.tool

    def preset(self, number: int, tool: CoordRef) -> None:
        """Define a slot and select it, as somebody did earlier today."""
        self._memory.define(number, self._units.given(tool), "nozzle")
        self._apply(number, self._memory.slot(number).tool, "nozzle")

    def preselect(self, number: int) -> None:
        """Select the tool of a slot outside the mailbox; 0 for none."""
        if number:
            slot = self._memory.slot(number)
            self._apply(number, slot.tool, slot.name)
        else:
            self.forget()

    def set_tool(self) -> Answer:
        """Return the tool for movements to come."""
        return self._answer(self._group.tool)

    def _write(self, command: Command) -> CommandResult:
        number = require_slot(command.operands[0])
        require_finite(command.pose)
        x, y, z, a, b, c = (part + 0.0 for part in command.pose)  # makes -0.0 a zero
        pose: Six = (x, y, z, a, b, c)
        lengths_mm = self._units.pose(pose)[:3]
        named = command.name.isascii() and command.name.isprintable()
        if not named or max(map(abs, lengths_mm)) > _LONGEST_MM:
            raise Rejected(ErrorClass.OPERAND)
        result = ok()
        if number == self.selected:
            result = self._apply(number, pose, command.name)
        if result.execution.outputs.done:
            self._memory.define(number, pose, command.name)
        return result

    def _select(self, command: Command) -> CommandResult:
        number = command.operands[0]
        if number == 0:
            result = self._apply(0, _NO_TOOL, "")
        else:
            slot = self._memory.slot(require_slot(number))
            if not slot.defined:
                raise Rejected(ErrorClass.SLOT_EMPTY)
            result = self._apply(number, slot.tool, slot.name)
        return CommandResult(result.execution, self.set_tool())

    def _read(self, command: Command) -> CommandResult:
        mode = ReadToolMode(require_operand(command.operands[0], range(len(ReadToolMode))))
        # The interrupted movement is the active movement of the mailbox.
        waits = mode is ReadToolMode.ACTIVE_MOVEMENT and self._group.motion.interrupted
        try:
            tool = self._group.continue_tool_offset() if waits else self._group.read_tool(mode)
        except BlockRefused as refused:
            error_class = class_of(refused.kind, self._group.state)
            number = self._group.options.numbers.error(refused.kind).number
            raise Rejected(error_class, number) from None
        return ok(self._answer(tool))

    def _clear(self, command: Command) -> CommandResult:
        number = require_slot(command.operands[0])
        if number == self.selected:
            raise Rejected(ErrorClass.WRONG_STATE)
        self._memory.clear(number)
        return ok()

    def _set_kinematics(self, command: Command) -> CommandResult:
        position, orientation, *_ = command.operands
        execution = self._group.set_kin_transform(self._kinematics(position, orientation))
        if execution.outputs.done:
            self.forget()
        return CommandResult(execution)

    def _kinematics(self, position: int, orientation: int) -> KinematicsModel:
        """Return the kinematics of two codes; one of the machine builder's own is its own."""
        if kinematics_word(position, orientation) == self._built_in[0]:
            return self._built_in[1]
        name = _block_name(position)
        if orientation:
            name += _COUPLING + _block_name(orientation)
        if name not in NAMES:
            raise Rejected(ErrorClass.NO_KINEMATICS)
        known = parameter_names(name)
        parameters = {key: value for key, value in self._parameters.items() if key in known}
        try:
            return machine_named(name, parameters).kinematics
        except ConfigError:  # its values and the machine's parameters give no kinematics
            raise Rejected(ErrorClass.NO_KINEMATICS) from None

    def _apply(self, number: int, tool: Six, name: str) -> CommandResult:
        execution = self._group.set_tool(self._units.tool(tool), name)
        if execution.outputs.done:
            self.selected = number
            self._applied = self._group.tool
        return CommandResult(execution)

    def _answer(self, tool: ToolInForce) -> Answer:
        return Answer.of_pose(self._units.given(CoordRef.of(tool.frame)))


def _code(block_name: str) -> Kinematics:
    return find_kinematics(block_name) or Kinematics.CUSTOM


def _block_name(code: int) -> str:
    try:
        return Kinematics(code).block_name
    except ValueError:
        raise Rejected(ErrorClass.OPERAND) from None
