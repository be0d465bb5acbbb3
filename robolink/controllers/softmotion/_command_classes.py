"""What a command does to the machine behind a mailbox, as far as a stop cares."""

from typing import Final

from robolink.protocols.mailbox import Command, Opcode
from robolink.stop_latch import CommandClass

_CLASSES: Final = {
    Opcode.OWNERSHIP: CommandClass.LOOK,
    Opcode.READ_TOOL: CommandClass.LOOK,
    Opcode.READ_INPUT: CommandClass.LOOK,
    Opcode.STOP: CommandClass.CALM,
    Opcode.HALT: CommandClass.CALM,
    Opcode.INTERRUPT: CommandClass.CALM,
    Opcode.RESET: CommandClass.CALM,
    Opcode.DISABLE: CommandClass.CALM,
    Opcode.SELECT_TOOL: CommandClass.RESTORE,
    Opcode.WRITE_TOOL: CommandClass.WRITE,
    Opcode.CLEAR_TOOL: CommandClass.WRITE,
}
"""Every other opcode acts. To release a held stop (2003 with i0 = 1) moves nothing by itself."""


def command_class_of(command: Command) -> CommandClass:
    """Return what ``command`` does; an end of a jog, both masks 0, calms."""
    if command.opcode == Opcode.JOG and not any(command.operands[:2]):
        return CommandClass.CALM
    return _CLASSES.get(Opcode(command.opcode), CommandClass.ACT)
