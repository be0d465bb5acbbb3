"""The opcodes about inputs and outputs (docs/mailbox.md)."""

from collections.abc import Mapping
from types import MappingProxyType

from robolink.protocols.mailbox import Answer, Command, Opcode
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.mailbox.commands.operands import require_operand
from robolink_simulators.softmotion.mailbox.commands.told import Handler, Told, done
from robolink_simulators.softmotion.signals import SIGNALS


class SignalDesk:
    """Reads inputs and switches outputs.

    Args:
        group: Beside which they are.

    Attributes:
        opcodes: What it can do.
    """

    def __init__(self, group: AxisGroup) -> None:
        self._group = group
        self.opcodes: Mapping[int, Handler] = MappingProxyType(
            {Opcode.READ_INPUT: self._read, Opcode.WRITE_OUTPUT: self._write}
        )

    def _read(self, command: Command) -> Told:
        number = require_operand(command.operands[0], range(SIGNALS))
        return done(Answer.of_input(int(self._group.inputs.read(number, self._group.values))))

    def _write(self, command: Command) -> Told:
        number = require_operand(command.operands[0], range(SIGNALS))
        on = require_operand(command.operands[1], range(2))
        self._group.outputs.switch(number, on == 1)
        return done()
