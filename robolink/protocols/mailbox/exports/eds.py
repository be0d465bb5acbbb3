"""The electronic data sheet (CiA 306) of a PLC that serves the mailbox on CANopen.

The CANopen objects of the mailbox.

Source: docs/reference/mailbox.md, "CANopen"; docs/reference/softmotion.md 4.7.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from robolink.protocols.mailbox._layout import COMMAND, PROBE, SLOTS, VERSION, WordType

UNSIGNED8: Final = 0x05
UNSIGNED16: Final = 0x06
UNSIGNED32: Final = 0x07
DOMAIN: Final = 0x0F

_CAN_TYPES: Final = {
    WordType.UINT: UNSIGNED16,
    WordType.INT: 0x03,
    WordType.UDINT: UNSIGNED32,
    WordType.DINT: 0x04,
    WordType.REAL: 0x08,
    WordType.LREAL: 0x11,
    WordType.CHARS: 0x09,
}

PRODUCER_HEARTBEAT_MS: Final = 100
EVENT_TIMER_MS: Final = 100


@dataclass(frozen=True, slots=True)
class Entry:
    """One variable: an object of its own, or one sub-index of a record.

    ``default`` is written as an EDS wants it; ``mapped`` says that a PDO carries it.
    """

    name: str
    type: int
    access: str = "ro"
    default: str = ""
    mapped: bool = False


class Shape(Enum):
    """What stands at an index: one entry, or several from sub-index 1; the value is CiA's code."""

    VARIABLE = 7
    ARRAY = 8
    RECORD = 9


@dataclass(frozen=True, slots=True)
class Object:
    """One index of the object dictionary."""

    index: int
    name: str
    entries: tuple[Entry, ...]
    shape: Shape = Shape.RECORD


def _variable(index: int, entry: Entry) -> Object:
    return Object(index, entry.name, (entry,), Shape.VARIABLE)


def _record(index: int, name: str, *entries: Entry) -> Object:
    return Object(index, name, entries)


def _array(index: int, name: str, *entries: Entry) -> Object:
    return Object(index, name, entries, Shape.ARRAY)


def _command_fields() -> Iterator[Entry]:
    for field in COMMAND.fields:
        kind = _CAN_TYPES[field.type]
        mapped = field.name == "client_heartbeat"
        for n in range(field.count):
            name = field.name if field.count == 1 else f"{field.name}_{n}"
            yield Entry(name, kind, "rww" if mapped else "rw", mapped=mapped)


COMMAND_FIELDS: Final = tuple(_command_fields())

HEAD_FIELDS: Final = (
    Entry("ack", UNSIGNED16, mapped=True),
    Entry("state", UNSIGNED8, mapped=True),
    Entry("group_state", UNSIGNED8, mapped=True),
    Entry("error_class", UNSIGNED16, mapped=True),
    Entry("heartbeat", UNSIGNED16, mapped=True),
)
"""Content of TPDO1, in this order."""

MAILBOX_OBJECTS: Final = (
    _variable(0x2100, Entry("command", DOMAIN, "rw")),
    _variable(0x2101, Entry("response", DOMAIN)),
    _record(
        0x2102,
        "mailbox",
        Entry("version", UNSIGNED16, default=f"0x{VERSION:04X}"),
        Entry("boot_id", UNSIGNED16),
        Entry("capabilities", UNSIGNED16),
        Entry("probe", _CAN_TYPES[WordType.LREAL], default=str(PROBE)),
        Entry("snapshot", UNSIGNED16, "rw"),
    ),
    _record(0x2103, "head", *HEAD_FIELDS),
    _record(0x2110, "command_fields", *COMMAND_FIELDS),
    _array(0x2200, "tool_slot", *(Entry(f"slot_{n}", DOMAIN) for n in SLOTS)),
)
"""Objects of docs/reference/mailbox.md, and 0x2103: a PDO can only carry values of an object."""


def _mapping(index: int, entries: tuple[Entry, ...]) -> Iterator[Entry]:
    bits = {UNSIGNED8: 8, UNSIGNED16: 16}
    for subindex, entry in enumerate(entries, 1):
        if entry.mapped:
            target = f"0x{index:04X}{subindex:02X}{bits[entry.type]:02X}"
            yield Entry(entry.name, UNSIGNED32, default=target)


def _channel(index: int, name: str, cob_id: int, *more: Entry) -> Object:
    return _record(
        index,
        name,
        Entry("COB-ID", UNSIGNED32, "rw", f"$NODEID+0x{cob_id:X}"),
        Entry("transmission type", UNSIGNED8, "rw", "255"),
        *more,
    )


MANDATORY_OBJECTS: Final = (
    _variable(0x1000, Entry("device type", UNSIGNED32, default="0x00000000")),
    _variable(0x1001, Entry("error register", UNSIGNED8)),
    _record(
        0x1018,
        "identity",
        Entry("vendor-ID", UNSIGNED32, default="0x00000000"),
        Entry("product code", UNSIGNED32, default="0x00000000"),
        Entry("revision number", UNSIGNED32, default=f"0x{VERSION:08X}"),
        Entry("serial number", UNSIGNED32),
    ),
)

COMMUNICATION_OBJECTS: Final = (
    _array(
        0x1016, "consumer heartbeat time", Entry("node and time", UNSIGNED32, "rw", "0x00000000")
    ),
    _variable(
        0x1017,
        Entry("producer heartbeat time", UNSIGNED16, "rw", str(PRODUCER_HEARTBEAT_MS)),
    ),
    _channel(0x1400, "RPDO1", 0x200),
    _record(0x1600, "RPDO1 mapping", *_mapping(0x2110, COMMAND_FIELDS)),
    _channel(
        0x1800,
        "TPDO1",
        0x180,
        Entry("inhibit time", UNSIGNED16, "rw", "0"),
        Entry("reserved", UNSIGNED8, "rw", "0"),
        Entry("event timer", UNSIGNED16, "rw", str(EVENT_TIMER_MS)),
    ),
    _record(0x1A00, "TPDO1 mapping", *_mapping(0x2103, HEAD_FIELDS)),
)
"""Communication objects; the node that sends the client's NMT heartbeat is entered in 0x1016 on
site."""


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
