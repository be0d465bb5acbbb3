"""The blocks and codes as IEC 61131-3 data types for a CODESYS project."""

from collections.abc import Iterator
from enum import IntEnum, IntFlag
from typing import Final

from robolink.protocols.mailbox._codes import (
    Bits,
    BufferMode,
    Capability,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    ExportProfile,
    GroupState,
    ReadMode,
)
from robolink.protocols.mailbox._kinematics import Kinematics
from robolink.protocols.mailbox._opcodes import opcodes_of
from robolink.protocols.mailbox.blocks.layout import Field, Layout, WordType
from robolink.protocols.mailbox.blocks.register_layouts import (
    COMMAND,
    DEVICE,
    PROBE,
    RESPONSE,
    SLOT,
    SLOTS,
    VERSION,
)

_HEAD: Final = """\
// robolink_mailbox_types.st: the mailbox's blocks and codes, version 1.
// SPDX-License-Identifier: 0BSD
//
// Made by robolink expert plc export; not to be edited.
//
// The structures are packed, so that they are what the registers hold. Copy values in and out
// of them; keep no pointer or reference to a member: some targets fault on REAL and LREAL that
// do not lie on their natural boundary.
"""


def structured_text_types(profile: ExportProfile = ExportProfile.FULL) -> str:
    """Return the types; the opcodes and the capability word are those of ``profile``."""
    parts = (
        _HEAD,
        _constants(profile),
        _enumeration("RL_Opcode", "OP", opcodes_of(profile)),
        _enumeration("RL_CommandState", "STATE", tuple(CommandState)),
        _enumeration("RL_GroupState", "GROUP", tuple(GroupState)),
        _enumeration("RL_ErrorClass", "ERR", tuple(ErrorClass)),
        _enumeration("RL_Bits", "BIT", tuple(Bits)),
        _enumeration("RL_Capability", "CAP", tuple(Capability)),
        _enumeration("RL_CoordinateSystem", "CS", tuple(CoordinateSystem)),
        _enumeration("RL_BufferMode", "BM", tuple(BufferMode)),
        _enumeration("RL_ReadMode", "READ", tuple(ReadMode)),
        _enumeration("RL_Kinematics", "KIN", tuple(Kinematics)),
        *_block("RL_Command", COMMAND),
        *_block("RL_Response", RESPONSE),
        *_block("RL_Slot", SLOT),
        *_block("RL_Device", DEVICE),
    )
    return "\n".join(parts)


def _constants(profile: ExportProfile) -> str:
    return f"""\
{{attribute 'qualified_only'}}
VAR_GLOBAL CONSTANT
    VERSION : UINT := 16#{VERSION:04X};
    PROBE : LREAL := {PROBE};
    SLOTS : UINT := {len(SLOTS)};
    CAPABILITIES : UINT := {profile.capabilities.value}; // of the profile {profile}
END_VAR
"""


def _enumeration(name: str, prefix: str, codes: tuple[IntEnum | IntFlag, ...]) -> str:
    """Each name gets a prefix: CONTINUE and others are keywords of the language."""
    members = ",\n".join(f"    {prefix}_{code.name} := {code.value}" for code in codes)
    return f"{{attribute 'qualified_only'}}\nTYPE {name} : (\n{members}\n) UINT;\nEND_TYPE\n"


def _block(name: str, layout: Layout) -> Iterator[str]:
    members = "\n".join(map(_member, layout.fields))
    yield (
        f"{{attribute 'pack_mode' := '1'}}\n"
        f"TYPE {name} : STRUCT // {layout.words} words\n{members}\nEND_STRUCT\nEND_TYPE\n"
    )
    yield (
        f"TYPE {name}Image : UNION\n"
        f"    words : ARRAY[0..{layout.words - 1}] OF UINT;\n"
        f"    block : {name};\n"
        f"END_UNION\nEND_TYPE\n"
    )


def _member(field: Field) -> str:
    if field.type is WordType.CHARS:
        of = "ARRAY[0..15] OF BYTE"
    elif field.count > 1:
        of = f"ARRAY[0..{field.count - 1}] OF {field.type.name}"
    else:
        of = field.type.name
    return f"    {field.name} : {of}; // word {field.word}: {field.note}"
