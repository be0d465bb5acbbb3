"""The electronic data sheet (CiA 306) of a PLC that serves the mailbox on CANopen."""

from collections.abc import Iterator, Sequence
from typing import Final

from robolink.protocols.mailbox.exports.object_dictionary import (
    COMMUNICATION_OBJECTS,
    DOMAIN,
    MAILBOX_OBJECTS,
    MANDATORY_OBJECTS,
    UNSIGNED8,
    Entry,
    Object,
    Shape,
)

_DOMAIN_CODE: Final = 2
_BAUD_RATES: Final = (10, 20, 50, 125, 250, 500, 800, 1000)

_HEAD: Final = """\
[FileInfo]
FileName=robolink_mailbox.eds
FileVersion=1
FileRevision=0
EDSVersion=4.0
Description=robolink mailbox, version 1
CreationTime=12:00PM
CreationDate=11-21-2026
CreatedBy=robolink expert plc export
ModificationTime=12:00PM
ModificationDate=11-21-2026
ModifiedBy=robolink expert plc export

[Comments]
Lines=2
Line1=SPDX-License-Identifier: 0BSD. Made by robolink expert plc export; not to be edited.
Line2=Vendor-ID and product code are 0: put in those of the PLC's own data sheet.

"""


def electronic_data_sheet() -> str:
    """Return the EDS, the same text every time."""
    groups = {
        "MandatoryObjects": MANDATORY_OBJECTS,
        "OptionalObjects": COMMUNICATION_OBJECTS,
        "ManufacturerObjects": MAILBOX_OBJECTS,
    }
    sections = [_HEAD, _device(), _dummies()]
    for name, objects in groups.items():
        indices = [f"{n}=0x{item.index:04X}" for n, item in enumerate(objects, 1)]
        sections.append(_section(name, [f"SupportedObjects={len(objects)}", *indices]))
        for item in objects:
            sections += _sections(item)
    return "".join(sections)


def _device() -> str:
    rates = [f"BaudRate_{rate}=1" for rate in _BAUD_RATES]
    facts = [
        "VendorName=robolink",
        "VendorNumber=0",
        "ProductName=robolink mailbox",
        "ProductNumber=0",
        "RevisionNumber=0x0100",
        "OrderCode=0",
        "SimpleBootUpMaster=0",
        "SimpleBootUpSlave=1",
        "Granularity=8",
        "DynamicChannelsSupported=0",
        "GroupMessaging=0",
        "NrOfRXPDO=1",
        "NrOfTXPDO=1",
        "LSS_Supported=0",
    ]
    return _section("DeviceInfo", rates + facts)


def _dummies() -> str:
    return _section("DummyUsage", [f"Dummy{n:04d}=0" for n in range(1, 8)])


def _sections(item: Object) -> Iterator[str]:
    title = f"{item.index:04X}"
    if item.shape is Shape.VARIABLE:
        yield _entry(title, item.entries[0])
        return
    code = item.shape.value
    number = len(item.entries)
    yield _section(
        title,
        [f"ParameterName={item.name}", f"ObjectType=0x{code:X}", f"SubNumber={number + 1}"],
    )
    yield _entry(f"{title}sub0", Entry("highest sub-index", UNSIGNED8, "ro", str(number)))
    for subindex, entry in enumerate(item.entries, 1):
        yield _entry(f"{title}sub{subindex:X}", entry)


def _entry(title: str, entry: Entry) -> str:
    code = _DOMAIN_CODE if entry.type == DOMAIN else Shape.VARIABLE.value
    lines = [
        f"ParameterName={entry.name}",
        f"ObjectType=0x{code:X}",
        f"DataType=0x{entry.type:04X}",
        f"AccessType={entry.access}",
        f"PDOMapping={int(entry.mapped)}",
    ]
    if entry.default:
        lines.append(f"DefaultValue={entry.default}")
    return _section(title, lines)


def _section(title: str, lines: Sequence[str]) -> str:
    return "\n".join([f"[{title}]", *lines, "", ""])
