"""The register map as a table for programs (CSV) and a page for people (Markdown)."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum, IntFlag

from robolink.protocols.mailbox._codes import (
    Bits,
    BufferMode,
    Capability,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    ExportProfile,
    GroupState,
    error_meaning,
)
from robolink.protocols.mailbox._kinematics import Kinematics
from robolink.protocols.mailbox._opcodes import OPCODES, opcodes_of
from robolink.protocols.mailbox.blocks.layout import Field, Layout
from robolink.protocols.mailbox.blocks.register_layouts import (
    COMMAND,
    DEVICE,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE,
    SLOT,
    SLOT_WORDS,
    SLOTS,
    slot_start,
)

_COLUMNS = ("block", "address", "reference", "words", "name", "type", "note")
_HOLDING, _INPUT = "4", "3"


def register_map_csv(base: int = 0) -> str:
    """Return every field with its address.

    ``address`` is what goes over the wire, counted from 0; ``reference`` is the number that
    many programs show, counted from 1 behind the digit of the register's kind.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(_COLUMNS)
    rows.writerows(_rows("command", COMMAND, _HOLDING, base))
    rows.writerows(_rows("response", RESPONSE, _INPUT, base))
    for slot in SLOTS:
        rows.writerows(_rows(f"slot {slot}", SLOT, _INPUT, base + slot_start(slot)))
    rows.writerows(_rows("device", DEVICE, _INPUT, base + DEVICE_START))
    return text.getvalue()


def _rows(block: str, layout: Layout, kind: str, base: int) -> Iterator[Sequence[str | int]]:
    for field in layout.fields:
        address = base + field.word
        words = field.end - field.word
        yield block, address, _reference(kind, address), words, field.name, _type(field), field.note


def _reference(kind: str, address: int) -> str:
    return f"{kind}{address + 1:04d}"


def _type(field: Field) -> str:
    return field.type.name if field.count == 1 else f"{field.count} {field.type.name}"


def register_map_markdown(profile: ExportProfile = ExportProfile.FULL, base: int = 0) -> str:
    """Return the page: blocks, opcodes of ``profile``, and every table of codes."""
    slots = base + slot_start(1)
    parts = (
        _HEAD,
        _block("Command block", COMMAND, base, _HOLDING, "holding registers, one FC16"),
        _block("Response block", RESPONSE, base, _INPUT, "input registers, one FC04"),
        _block("Tool slot 1", SLOT, slots, _INPUT, f"each further slot {SLOT_WORDS} words on"),
        _block("Device block", DEVICE, base + DEVICE_START, _INPUT, "behind the last slot"),
        _opcodes(profile),
        _codes("Command states", CommandState),
        _codes("Group states", GroupState),
        _codes("Coordinate systems", CoordinateSystem),
        _codes("Buffer modes", BufferMode),
        _flags("Bits", Bits),
        _flags("Capabilities", Capability),
        _section("Error classes", ("code", "meaning"), _errors()),
        _section("Kinematics", ("code", "function block"), _kinematics()),
    )
    return "\n".join(parts)


_HEAD = f"""# Mailbox, version 1: register map

Made by `robolink expert plc export`; not to be edited.

Words of 16 bits. Values of several words stand low word first. Addresses count from 0, as they
go over the wire; the reference in brackets counts from 1. The response block and the fifteen
slots and the device block behind it take {DEVICE_START + DEVICE_WORDS} input registers.
"""


def _block(title: str, layout: Layout, base: int, kind: str, access: str) -> str:
    rows = (
        (
            field.word,
            f"{base + field.word} ({_reference(kind, base + field.word)})",
            field.name,
            _type(field),
            field.note,
        )
        for field in layout.fields
    )
    full_title = f"{title}: {layout.words} words, {access}"
    return _section(full_title, ("word", "address", "name", "type", "note"), rows)


def _opcodes(profile: ExportProfile) -> str:
    rows = (
        (code.value, code.name, facts.does, facts.operands, facts.answer)
        for code, facts in OPCODES.items()
        if code in opcodes_of(profile)
    )
    columns = ("opcode", "name", "does", "operands", "answer")
    return _section(f"Opcodes of the profile {profile}", columns, rows)


def _codes(title: str, codes: type[IntEnum]) -> str:
    return _section(title, ("code", "name"), ((code.value, code.name) for code in codes))


def _flags(title: str, flags: type[IntFlag]) -> str:
    rows = ((flag.bit_length() - 1, flag.name or "") for flag in flags)
    return _section(title, ("bit", "name"), rows)


def _errors() -> Iterator[tuple[int, str]]:
    return ((code.value, error_meaning(code)) for code in ErrorClass)


def _kinematics() -> Iterator[tuple[int, str]]:
    return ((code.value, code.block_name or code.name.lower()) for code in Kinematics)


def _section(title: str, columns: Sequence[str], rows: Iterable[Sequence[str | int]]) -> str:
    lines = [f"## {title}", "", _line(columns), _line(["---"] * len(columns)), *map(_line, rows)]
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str | int]) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"
