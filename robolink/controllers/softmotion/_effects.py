"""What a command does to the machine behind a mailbox, as far as a stop cares."""

from typing import Final

from robolink.protocols.mailbox import Command, Opcode
from robolink.stop_latch import Effect

_EFFECTS: Final = {
    Opcode.OWNERSHIP: Effect.LOOK,
    Opcode.READ_TOOL: Effect.LOOK,
    Opcode.READ_INPUT: Effect.LOOK,
    Opcode.STOP: Effect.CALM,
    Opcode.HALT: Effect.CALM,
    Opcode.INTERRUPT: Effect.CALM,
    Opcode.RESET: Effect.CALM,
    Opcode.DISABLE: Effect.CALM,
    Opcode.SELECT_TOOL: Effect.RESTORE,
    Opcode.WRITE_TOOL: Effect.WRITE,
    Opcode.CLEAR_TOOL: Effect.WRITE,
}
"""Every other opcode acts. To release a held stop (2003 with i0 = 1) moves nothing by itself."""


def effect_of(command: Command) -> Effect:
    """Return what ``command`` does; an end of a jog, both masks 0, calms."""
    if command.opcode == Opcode.JOG and not any(command.operands[:2]):
        return Effect.CALM
    return _EFFECTS.get(Opcode(command.opcode), Effect.ACT)
