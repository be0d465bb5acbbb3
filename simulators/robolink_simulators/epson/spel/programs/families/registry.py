"""Which family compiles a statement. A new family adds its row here."""

from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink_simulators.epson.spel.line_tree import (
    AssignElement,
    Call,
    ChannelStatement,
    TaskStatement,
    Trap,
    VisionAccess,
    VisionRun,
    VisionStatement,
)
from robolink_simulators.epson.spel.programs.emitter import Emitter
from robolink_simulators.epson.spel.programs.families.channels import CHANNEL_STATEMENTS
from robolink_simulators.epson.spel.programs.families.control import TASK_STATEMENTS
from robolink_simulators.epson.spel.programs.families.files import FILE_STATEMENTS
from robolink_simulators.epson.spel.programs.families.interrupts import compile_trap
from robolink_simulators.epson.spel.programs.families.texts import PROCEDURES
from robolink_simulators.epson.spel.programs.families.timers import TIMERS
from robolink_simulators.epson.spel.programs.families.vision import compile_access, compile_run
from robolink_simulators.epson.spel.programs.families.vision_calibrating import (
    VISION_STATEMENTS,
)
from robolink_simulators.epson.spel.tasks.compiled import JumpTarget, Operation

FamilyStatement = (
    TaskStatement
    | ChannelStatement
    | Trap
    | Call
    | AssignElement
    | VisionRun
    | VisionAccess
    | VisionStatement
)

PROCEDURE_TABLES: Final = (PROCEDURES, TIMERS)
"""Statements written as a call; the first table that knows a name compiles it."""

_Compiler = Callable[[Emitter, Call], Operation]


def compile_family(
    emitter: Emitter, node: FamilyStatement, target: JumpTarget | None = None
) -> Operation:
    """Return the operation of a statement that only programs know.

    Raises:
        ProgramFault: It is not known, or makes no sense.
    """
    match node:
        case Trap():
            return compile_trap(emitter, node, target)
        case VisionRun():
            return compile_run(emitter, node)
        case VisionAccess():
            return compile_access(emitter, node)
        case VisionStatement(word):
            return VISION_STATEMENTS[word](emitter, node)
        case TaskStatement(word):
            return TASK_STATEMENTS[word](emitter, node)
        case ChannelStatement(word):
            table = FILE_STATEMENTS if word in FILE_STATEMENTS else CHANNEL_STATEMENTS
            return table[word](emitter, node)
        case Call(name):
            for procedures in PROCEDURE_TABLES:
                if name in procedures:
                    return procedures[name](emitter, node)
            raise emitter.fault(tr("there is no statement and no function {name}", name=name))
        case AssignElement(name):
            raise emitter.fault(tr("nothing is called {name}", name=name))
