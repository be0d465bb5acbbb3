"""Bytes of structures that a server sent: nearly valid ones are refused, and soon."""

import struct
from typing import Any

import pytest
from asyncua import ua

from robolink.transport.opcua.structures import StructureType, fields_of

ENCODING = ua.NodeId(5, 4)


def structure(*fields: ua.VariantType, array: bool = False) -> StructureType:
    definition = ua.StructureDefinition(DefaultEncodingId=ENCODING)
    definition.Fields = [
        ua.StructureField(
            Name=f"f{number}", DataType=ua.NodeId(kind.value), ValueRank=1 if array else -1
        )
        for number, kind in enumerate(fields)
    ]
    made = fields_of(definition, {ua.NodeId(kind.value).to_string(): kind for kind in fields})
    assert made is not None
    return made


def taken(of: StructureType, body: bytes) -> Any:
    found = of.decoded(ua.ExtensionObject(ENCODING, body))
    assert found is not None
    return found[1]


@pytest.mark.parametrize("before", [b"\x80", b"\xc0"])
def test_an_array_of_nulls_within_is_not_taken_apart(before: bytes) -> None:
    """With the most elements that it may say, this takes minutes and all of the memory."""
    count = struct.pack("<i", 100_000)
    with pytest.raises(ValueError, match="an array of 100000 nulls"):
        taken(structure(ua.VariantType.Variant), before + count + bytes(4))


def test_a_text_of_negative_length_within_an_array_is_refused() -> None:
    """Read as it says, each element gives its own bytes back, and the next is read from them."""
    with pytest.raises(ValueError, match="a length of -4"):
        taken(structure(ua.VariantType.String, array=True), struct.pack("<ii", 100_000, -4))


@pytest.mark.parametrize("byte", [0x80, 0xC0])
def test_a_byte_that_looks_like_an_array_is_a_byte(byte: int) -> None:
    of = structure(ua.VariantType.Byte, ua.VariantType.Int32)
    assert taken(of, struct.pack("<Bi", byte, 5_000_000)) == {"f0": byte, "f1": 5_000_000}
