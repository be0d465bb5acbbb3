"""The sources of the mailbox program, for a profile and a kinematics (docs/plc-program.md).

The mailbox program as one PLCopen XML file, in the form that CODESYS writes.

Source: docs/reference/structured_text.md 3. The import into a real CODESYS is untried.

The blocks and codes as IEC 61131-3 data types for a CODESYS project.

The units of our own Structured Text: types, blocks and lists, with their variables.

It reads what robolink's sources look like and nothing else; what it does not know it refuses.
"""

import re
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag, StrEnum
from importlib.resources import files
from typing import Final
from xml.sax.saxutils import escape, quoteattr

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
    opcodes_of,
)
from robolink.protocols.mailbox._kinematics import Kinematics, find_kinematics_word
from robolink.protocols.mailbox._layout import (
    COMMAND,
    DEVICE,
    PROBE,
    RESPONSE,
    SLOT,
    SLOTS,
    VERSION,
    Field,
    Layout,
    WordType,
)

PROGRAM_FILES: Final = (
    "robolink_core.st",
    "RL_Kept.st",
    "RL_Machine.st",
    "robolink_softmotion.st",
    "robolink_program.st",
)
"""Source files, each after those that it uses."""
SYMBOL_LIST: Final = "RL_Symbols.st"
"""The list that an OPC UA server shows; only a program for OPC UA has it."""

_MARKED_SECTION: Final = (
    r"[ ]*(?:\(\*|//) {name}:(?: \*\))?\n(.*?)[ ]*(?:\(\*|//) end {name}(?: \*\))?\n"
)
_READ_MODES: Final = ("RL_SET_SYMBOL", "RL_ACTIVE_SYMBOL", "RL_LAST_SYMBOL")
_ADDRESS: Final = re.compile(r"AT %([IQ])W(\d+)")


def program_texts(
    profile: ExportProfile = ExportProfile.FULL,
    *,
    base: int = 0,
    kinematics: str = "",
    read_modes: Sequence[str] = (),
    opcua: bool = False,
) -> Mapping[str, str]:
    """Return the sources by file name, each after those that it uses.

    Args:
        profile: With ``TOOLS`` nothing that moves is in the text.
        base: The first word of inputs and outputs.
        kinematics: Block name of the axis group's kinematics, such as ``Kin_Scara3_Z``, or of two
            that are coupled, ``Kin_Gantry3+Kin_CAxis``; opcode 30004 sets it again. Without one
            that opcode is refused, 303.
        read_modes: Symbols of SMC_READ_TOOL_MODE for the set tool, that of the active movement
            and that of the movement commanded last. With them the program reads the tool by
            SMC_GroupReadTool; without, since no document names them, it remembers the one that
            it set last.
        opcua: Whether clients come over OPC UA. Then the list ``RL_Symbols`` stands in the place
            of the three addresses.

    Example:
        >>> from robolink.protocols.mailbox import ExportProfile
        >>> from robolink.protocols.mailbox.exports import program_texts
        >>> texts = program_texts(ExportProfile.TOOLS, kinematics="Kin_Scara3_Z")
        >>> "robolink_core.st" in texts
        True
    """
    folder = files(__package__) / "program_sources"
    code = find_kinematics_word(kinematics) or 0
    position, coupled, orientation = kinematics.partition("+")
    keep = {"full": profile is ExportProfile.FULL}
    keep["kinematics"] = keep["full"] and bool(code)
    keep["no kinematics"] = not keep["kinematics"]
    keep["coupled"] = keep["kinematics"] and bool(coupled)
    keep |= {"read tool": bool(read_modes), "from memory": not read_modes}
    keep |= {"symbols": opcua, "registers": not opcua}
    names = (*PROGRAM_FILES[:-1], SYMBOL_LIST, PROGRAM_FILES[-1]) if opcua else PROGRAM_FILES
    texts = {}
    for name in names:
        text = (folder / name).read_text(encoding="ascii")
        for section, kept in keep.items():
            pattern = re.compile(_MARKED_SECTION.format(name=section), re.DOTALL)
            text = pattern.sub(r"\1" if kept else "", text)
        text = text.replace("RL_KINEMATICS_TYPE", "Kin_Coupled" if coupled else kinematics)
        text = text.replace("RL_POSITION_TYPE", position)
        text = text.replace("RL_ORIENTATION_TYPE", orientation)
        for placeholder, symbol in zip(_READ_MODES, read_modes, strict=False):
            text = text.replace(placeholder, symbol)
        text = text.replace("kinematics : UINT := 0;", f"kinematics : UINT := {code};")
        texts[name] = _ADDRESS.sub(lambda at: f"AT %{at[1]}W{int(at[2]) + base}", text)
    return texts


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
        *_structure("RL_Command", COMMAND),
        *_structure("RL_Response", RESPONSE),
        *_structure("RL_Slot", SLOT),
        *_structure("RL_Device", DEVICE),
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


def _structure(name: str, layout: Layout) -> Iterator[str]:
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


_COMMENT: Final = re.compile(r"\(\*.*?\*\)|//[^\n]*|\{[^}]*\}", re.DOTALL)
_TYPE: Final = re.compile(
    r"^TYPE (\w+) : (?:(ARRAY [^;]+);|STRUCT\n(.*?)\n\s*END_STRUCT;\n)\s*END_TYPE$",
    re.MULTILINE | re.DOTALL,
)
_BLOCK: Final = re.compile(
    r"^(FUNCTION_BLOCK|PROGRAM) (\w+)\n(.*?)^END_\1$", re.MULTILINE | re.DOTALL
)
_SECTION: Final = re.compile(
    r"^\s*(VAR\w*)( RETAIN)?\n(.*?)^\s*END_VAR\n", re.MULTILINE | re.DOTALL
)
_VARIABLE: Final = re.compile(
    r"^\s*(\w+)(?: AT (%\w+))? : ([^:;]+?)(?: := ([^;]+))?;", re.MULTILINE | re.DOTALL
)


@dataclass(frozen=True, slots=True)
class DeclaredVariable:
    """A variable of a unit.

    Attributes:
        name: As it is written.
        type: Its type, as it is written.
        address: Its address, empty for none.
        first: What it holds at first, empty for what its type says.
    """

    name: str
    type: str
    address: str = ""
    first: str = ""


@dataclass(frozen=True, slots=True)
class DeclaredType:
    """A type: an array under a name, or a structure.

    Attributes:
        name: As it is written.
        array: What it is an array of, empty for a structure.
        members: Those of a structure.
    """

    name: str
    array: str
    members: Sequence[DeclaredVariable]


@dataclass(frozen=True, slots=True)
class DeclaredBlock:
    """A function block or a program.

    Attributes:
        kind: ``FUNCTION_BLOCK`` or ``PROGRAM``.
        name: As it is written.
        sections: Kind of the section, and its variables.
        declaration: Its head as text, without END_...
        body: Its statements.
    """

    kind: str
    name: str
    sections: Sequence[tuple[str, Sequence[DeclaredVariable]]]
    declaration: str
    body: str


def types_in(text: str) -> Iterator[DeclaredType]:
    """Return the types of a text, in order."""
    for match in _TYPE.finditer(_plain(text)):
        name, array, members = match.groups()
        yield DeclaredType(name, array or "", _variables(members or ""))


def blocks_in(text: str) -> Iterator[DeclaredBlock]:
    """Return the function blocks and programs of a text, in order."""
    for match in _BLOCK.finditer(text):
        kind, name, inside = match.groups()
        sections, end = [], 0
        for section in _SECTION.finditer(inside):
            sections.append((section[1], _variables(_plain(section[3]))))
            end = section.end()
        declaration = f"{kind} {name}\n{inside[:end]}"
        yield DeclaredBlock(kind, name, sections, declaration, inside[end:].strip("\n"))


def list_in(text: str) -> Sequence[DeclaredVariable]:
    """Return the variables of a list of global variables."""
    (section,) = _SECTION.finditer(_plain(text))
    return _variables(section[3])


def _variables(text: str) -> Sequence[DeclaredVariable]:
    found = [DeclaredVariable(m[1], m[3], m[2] or "", m[4] or "") for m in _VARIABLE.finditer(text)]
    if len(found) != text.count(";"):
        raise ValueError(text)
    return found


def _plain(text: str) -> str:
    """Return a text without comments and pragmas."""
    return _COMMENT.sub("", text)


_BASE: Final = "http://www.3s-software.com/plcopenxml/"
_SECTIONS: Final = {
    "VAR_INPUT": "inputVars",
    "VAR_OUTPUT": "outputVars",
    "VAR_IN_OUT": "inOutVars",
    "VAR": "localVars",
}
_ELEMENTARY: Final = frozenset(
    ["BOOL", "BYTE", "WORD", "DWORD", "INT", "UINT", "DINT", "UDINT", "LREAL", "TIME"]
)
_LISTS: Final = {"RL_Kept.st": ' retain="true"', "RL_Machine.st": "", SYMBOL_LIST: ""}
_IDS: Final = uuid.UUID("7d0cb4c5-3f4e-5cde-9a80-3a1f2b6f6f01")
_ARRAY: Final = re.compile(r"ARRAY \[(-?\d+)\.\.(-?\d+)\] OF (.+)", re.DOTALL)

_FRAME: Final = """\
<?xml version="1.0" encoding="utf-8"?>
<!-- SPDX-License-Identifier: 0BSD. Made by robolink expert plc export; not to be edited. -->
<project xmlns="http://www.plcopen.org/xml/tc6_{schema}">
  <fileHeader companyName="" productName="robolink" productVersion="1" \
creationDateTime="2026-01-01T00:00:00" />
  <contentHeader name="robolink_mailbox" modificationDateTime="2026-01-01T00:00:00">
    <coordinateInfo>
      <fbd><scaling x="1" y="1" /></fbd>
      <ld><scaling x="1" y="1" /></ld>
      <sfc><scaling x="1" y="1" /></sfc>
    </coordinateInfo>
    <addData>{information}</addData>
  </contentHeader>
  <types>
    <dataTypes>
{types}
    </dataTypes>
    <pous>
{blocks}
    </pous>
  </types>
  <instances><configurations /></instances>
  <addData>
{lists}
{tree}
  </addData>
</project>
"""


class PlcopenSchema(StrEnum):
    """Under which name space the file stands; nothing else of it differs.

    Source: docs/reference/structured_text.md 3.
    """

    CODESYS = "0200"
    """The format that CODESYS itself writes."""

    OPENPLC = "0201"
    """The only format that OpenPLC, Beremiz and IronPLC read."""


def plcopen_xml(texts: Mapping[str, str], schema: PlcopenSchema = PlcopenSchema.CODESYS) -> str:
    """Return the program as PLCopen XML.

    Types, both lists, function blocks and the program are in it; a task and libraries are not,
    because they are those of the project.

    Args:
        texts: The sources, by file name.
        schema: Under which name space it stands.
    """
    types = [made for text in texts.values() for made in types_in(text)]
    blocks = [made for text in texts.values() for made in blocks_in(text)]
    names = [made.name for made in types] + [made.name for made in blocks]
    lists = [name for name in _LISTS if name in texts]
    names += [name.partition(".")[0] for name in lists]
    return _FRAME.format(
        schema=schema,
        information=_data("projectinformation", "<ProjectInformation />"),
        types="\n".join(map(_type, types)),
        blocks="\n".join(map(_block, blocks)),
        lists="\n".join(_list(name, texts[name]) for name in lists),
        tree=_tree(names),
    )


def _type(unit: DeclaredType) -> str:
    if unit.array:
        of = _type_of(unit.array)
    else:
        of = f"<struct>{''.join(map(_variable, unit.members))}</struct>"
    return (
        f'      <dataType name="{unit.name}"><baseType>{of}</baseType>'
        f"<addData>{_object_id(unit.name)}</addData></dataType>"
    )


def _block(unit: DeclaredBlock) -> str:
    kind = "functionBlock" if unit.kind == "FUNCTION_BLOCK" else "program"
    order = list(_SECTIONS)
    sections = sorted(unit.sections, key=lambda section: order.index(section[0]))
    interface = "".join(
        f"<{_SECTIONS[name]}>{''.join(map(_variable, variables))}</{_SECTIONS[name]}>"
        for name, variables in sections
    )
    added = _plain_text(unit.declaration) + _object_id(unit.name)
    return (
        f'      <pou name="{unit.name}" pouType="{kind}"><interface>{interface}</interface>'
        f"<body><ST>{_paragraph(unit.body)}</ST></body><addData>{added}</addData></pou>"
    )


def _list(file: str, text: str) -> str:
    name = file.partition(".")[0]
    variables = "".join(map(_variable, list_in(text)))
    attributes = '<Attributes><Attribute Name="qualified_only" Value="" /></Attributes>'
    added = _data("attributes", attributes)
    if file == SYMBOL_LIST:  # what a variable is published as stands in its pragma alone
        added += _plain_text(text)
    added += _object_id(name)
    inside = f"{variables}<addData>{added}</addData>"
    held = f'<globalVars name="{name}"{_LISTS[file]}>{inside}</globalVars>'
    return "    " + _data("globalvars", held)


def _tree(names: Sequence[str]) -> str:
    objects = "".join(f'<Object Name="{name}" ObjectId="{_id(name)}" />' for name in names)
    folder = f'<Folder Name="robolink">{objects}</Folder>'
    structure = f"<ProjectStructure>{folder}</ProjectStructure>"
    return "    " + _data("projectstructure", structure, handle="discard")


def _variable(variable: DeclaredVariable) -> str:
    address = f' address="{variable.address}"' if variable.address else ""
    first = f"<initialValue>{_initial(variable)}</initialValue>" if variable.first else ""
    return (
        f'<variable name="{variable.name}"{address}>'
        f"<type>{_type_of(variable.type)}</type>{first}</variable>"
    )


def _initial(variable: DeclaredVariable) -> str:
    if variable.first.startswith("("):
        members = (it.split(":=") for it in variable.first.strip("()").split(","))
        held = (
            f'<value member="{name.strip()}"><simpleValue value={quoteattr(of.strip())} /></value>'
            for name, of in members
        )
        return f"<structValue>{''.join(held)}</structValue>"
    if not variable.first.startswith("["):
        return f"<simpleValue value={quoteattr(variable.first)} />"
    values: Iterable[str] = variable.first.strip("[]").split(",")
    items = (f"<value><simpleValue value={quoteattr(v.strip())} /></value>" for v in values)
    return f"<arrayValue>{''.join(items)}</arrayValue>"


def _type_of(text: str) -> str:
    array = _ARRAY.fullmatch(text)
    if array:
        low, high, element = array.groups()
        bounds = f'<dimension lower="{low}" upper="{high}" />'
        return f"<array>{bounds}<baseType>{_type_of(element)}</baseType></array>"
    return f"<{text} />" if text in _ELEMENTARY else f'<derived name="{text}" />'


def _xhtml(text: str) -> str:
    return f'<xhtml xmlns="http://www.w3.org/1999/xhtml">{escape(text)}</xhtml>'


def _paragraph(text: str) -> str:
    """Return a body as Beremiz and OpenPLC read it (docs/reference/structured_text.md 3)."""
    space = "http://www.w3.org/1999/xhtml"
    return f'<xhtml:p xmlns:xhtml="{space}">{escape(text)}</xhtml:p>'


def _plain_text(declaration: str) -> str:
    plain = f"<InterfaceAsPlainText>{_xhtml(declaration)}</InterfaceAsPlainText>"
    return _data("interfaceasplaintext", plain)


def _object_id(name: str) -> str:
    return _data("objectid", f"<ObjectId>{_id(name)}</ObjectId>", handle="discard")


def _id(name: str) -> uuid.UUID:
    """The same name has the same number in every export."""
    return uuid.uuid5(_IDS, name)


def _data(name: str, inside: str, handle: str = "implementation") -> str:
    return f'<data name="{_BASE}{name}" handleUnknown="{handle}">{inside}</data>'
