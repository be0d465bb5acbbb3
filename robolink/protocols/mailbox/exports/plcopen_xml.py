"""The mailbox program as one PLCopen XML file, in the form that CODESYS writes.

Source: docs/reference/structured_text.md 3. The import into a real CODESYS is untried.
"""

import re
import uuid
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from robolink.protocols.mailbox.exports.declared_units import (
    DeclaredBlock,
    DeclaredType,
    DeclaredVariable,
    blocks_in,
    list_in,
    types_in,
)

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
_LISTS: Final = {"RL_Kept.st": ' retain="true"', "RL_Machine.st": ""}
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
    """What CODESYS itself writes."""

    OPENPLC = "0201"
    """The only one that OpenPLC, Beremiz and IronPLC read."""


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
    names += [name.partition(".")[0] for name in _LISTS]
    return _FRAME.format(
        schema=schema,
        information=_data("projectinformation", "<ProjectInformation />"),
        types="\n".join(map(_type, types)),
        blocks="\n".join(map(_block, blocks)),
        lists="\n".join(_list(name, texts[name]) for name in _LISTS),
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
    plain = f"<InterfaceAsPlainText>{_xhtml(unit.declaration)}</InterfaceAsPlainText>"
    added = _data("interfaceasplaintext", plain) + _object_id(unit.name)
    return (
        f'      <pou name="{unit.name}" pouType="{kind}"><interface>{interface}</interface>'
        f"<body><ST>{_paragraph(unit.body)}</ST></body><addData>{added}</addData></pou>"
    )


def _list(file: str, text: str) -> str:
    name = file.partition(".")[0]
    variables = "".join(map(_variable, list_in(text)))
    attributes = '<Attributes><Attribute Name="qualified_only" Value="" /></Attributes>'
    added = _data("attributes", attributes) + _object_id(name)
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


def _object_id(name: str) -> str:
    return _data("objectid", f"<ObjectId>{_id(name)}</ObjectId>", handle="discard")


def _id(name: str) -> uuid.UUID:
    """The same name has the same number in every export."""
    return uuid.uuid5(_IDS, name)


def _data(name: str, inside: str, handle: str = "implementation") -> str:
    return f'<data name="{_BASE}{name}" handleUnknown="{handle}">{inside}</data>'
