"""The register map as a table for programs (CSV) and a page for people (Markdown).

The errors of SoftMotion that the program tells apart, as a table to be filled in on site.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum, IntFlag
from typing import Final

from robolink.protocols.mailbox._codes import (
    OPCODES,
    Bits,
    BufferMode,
    Capability,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    ExportProfile,
    GroupState,
    error_meaning,
    opcodes_of,
)
from robolink.protocols.mailbox._kinematics import Kinematics
from robolink.protocols.mailbox._layout import (
    COMMAND,
    DEVICE,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE,
    SLOT,
    SLOT_WORDS,
    SLOTS,
    Field,
    Layout,
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


_ROWS: Final = (
    ("wrongState", "SMC_AXIS_GROUP_WRONG_STATE", "201..204, 209", 11000),
    ("nothingToReset", "SMC_R_NO_ERROR_TO_RESET", ErrorClass.NOTHING_TO_RESET.value, 120),
    ("noSuchMovement", "", ErrorClass.NO_SUCH_MOVEMENT.value, ""),
    ("notAtContinue", "", ErrorClass.WRONG_STATE.value, ""),
    (
        "toolIncompatible",
        "SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS",
        f"{ErrorClass.TOOL_INCOMPATIBLE.value}, {ErrorClass.NO_ORIENTATION_IMAGE.value}",
        "",
    ),
    ("axesMismatch", "", ErrorClass.NO_KINEMATICS.value, ""),
    ("unreachable", "", ErrorClass.UNREACHABLE.value, ""),
    ("axisLimit", "", ErrorClass.UNREACHABLE.value, 10),
    ("posture", "", ErrorClass.UNREACHABLE.value, ""),
    ("parameter", "", ErrorClass.OPERAND.value, ""),
    ("dynamics", "", ErrorClass.DYNAMICS.value, ""),
    ("noPower", "", ErrorClass.AXIS.value, 14),
    ("axisError", "", ErrorClass.AXIS.value, 2),
    (
        "byAxis",
        "SMC_AXIS_GROUP_INTERRUPTED_BY_SINGLE_AXIS",
        ErrorClass.INTERRUPTED_BY_AXIS.value,
        "",
    ),
    ("pcsInUse", "SMC_AXIS_GROUP_PCS_STILL_IN_USE", ErrorClass.WRONG_STATE.value, ""),
    (
        "blending",
        "SMC_BLENDING_NOT_SUPPORTED_BY_PREVIOUS_MOVEMENT",
        ErrorClass.WRONG_STATE.value,
        "",
    ),
)


def error_table_csv() -> str:
    """Return the table: member of ``RL_Machine.numbers``, symbol, error class, number.

    A symbol or number is given where a document or a field report names it
    (docs/reference/softmotion.md 1.4); what is empty stands in the Library Manager.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("member", "symbol", "error_class", "number"))
    rows.writerows(_ROWS)
    return text.getvalue()
