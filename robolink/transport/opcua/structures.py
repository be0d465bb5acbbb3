"""Structures of a server's program, by the definition that the server gives of them.

asyncua makes classes of such definitions, by running source text that it writes from them. Here
nothing of what a server says is run: fields are taken apart in the order of the definition, and
all of the bytes have to be used up.

Source: OPC 10000-3, 8.48 (structure definition); OPC 10000-6, 5.2.7 (binary encoding).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from asyncua import ua
from asyncua.ua.ua_binary import (
    pack_uatype,
    pack_uatype_array,
    struct_to_binary,
    unpack_uatype,
    unpack_uatype_array,
)

from robolink.transport.opcua.values import BoundedBuffer, fits, shape

STRUCTURE: Final = "Structure"
"""Kind of a value that is a structure."""


@dataclass(frozen=True, slots=True)
class FieldFacts:
    """One field of a structure, as it was met.

    Attributes:
        name: Of the field.
        kind: Built-in type, as OPC UA calls it, or ``Structure``.
        lengths: Of an array; empty for a single value.
        fields: Those of a structure within.
    """

    name: str
    kind: str
    lengths: tuple[int, ...] = ()
    fields: tuple["FieldFacts", ...] = ()

    @property
    def type_name(self) -> str:
        """The type for display, for example ``Double[6]``."""
        return shape(self.kind, self.lengths)


@dataclass(frozen=True, slots=True)
class _Field:
    """One field of a definition: a built-in type or a structure, single or an array."""

    name: str
    of: "ua.VariantType | StructureType"
    array: bool


class StructureType:
    """Takes values of one structure apart, and puts them together.

    Args:
        encoding: Id of its binary encoding, which stands before each value.
        fields: In order.
    """

    def __init__(self, encoding: ua.NodeId, fields: tuple[_Field, ...]) -> None:
        self.encoding = encoding
        self._fields = fields

    def decoded(self, value: Any) -> tuple[tuple[FieldFacts, ...], dict[str, Any]] | None:  # noqa: ANN401 - what asyncua makes of it
        """Return fields and values of one structure; ``None`` where it is another one.

        Raises:
            ValueError, asyncua.ua.UaError: The bytes do not fit the definition.
        """
        if isinstance(value, ua.ExtensionObject):
            if value.TypeId != self.encoding or value.Body is None:
                return None
            body = value.Body
        elif value is None:
            return None
        else:  # of a type that another part of this process has made a class of
            body = struct_to_binary(value)
        data = BoundedBuffer(body)
        found = self._taken(data)
        if len(data):
            message = f"{len(data)} bytes are left"
            raise ValueError(message)
        return found

    def encoded(self, facts: tuple[FieldFacts, ...], value: object) -> ua.ExtensionObject | None:
        """Return what is written; ``None`` where a value does not fit the structure as met."""
        body = self._put(facts, value)
        return None if body is None else ua.ExtensionObject(self.encoding, body)

    def _taken(self, data: BoundedBuffer) -> tuple[tuple[FieldFacts, ...], dict[str, Any]]:
        facts, values = [], {}
        for field in self._fields:
            fact, values[field.name] = _taken(field, data)
            facts.append(fact)
        return tuple(facts), values

    def _put(self, facts: tuple[FieldFacts, ...], value: object) -> bytes | None:
        if not isinstance(value, Mapping) or list(value) != [fact.name for fact in facts]:
            return None
        parts = [
            _put(field, fact, value[field.name])
            for field, fact in zip(self._fields, facts, strict=True)
        ]
        if any(part is None for part in parts):
            return None
        return b"".join(part for part in parts if part is not None)


def _taken(field: _Field, data: BoundedBuffer) -> tuple[FieldFacts, Any]:
    data.at_value()
    if isinstance(field.of, StructureType):
        if not field.array:
            within, value = field.of._taken(data)  # noqa: SLF001 - of the same class
            return FieldFacts(field.name, STRUCTURE, (), within), value
        count = unpack_uatype(ua.VariantType.Int32, data)
        if count > len(data):  # each takes a byte at least
            message = f"{field.name} cannot have {count} elements"
            raise ValueError(message)
        taken = [field.of._taken(data) for _ in range(max(count, 0))]  # noqa: SLF001 - as above
        within = taken[0][0] if taken else ()
        if any(facts != within for facts, _ in taken):
            message = f"the elements of {field.name} differ"
            raise ValueError(message)
        facts = FieldFacts(field.name, STRUCTURE, (len(taken),), within)
        return facts, [value for _, value in taken]
    kind = str(field.of.name)
    if field.array:
        values = unpack_uatype_array(field.of, data) or []
        return FieldFacts(field.name, kind, (len(values),)), values
    return FieldFacts(field.name, kind), unpack_uatype(field.of, data)


def _put(field: _Field, fact: FieldFacts, value: Any) -> bytes | None:  # noqa: ANN401 - any value
    values = value if field.array else [value]
    if not isinstance(values, list | tuple) or (field.array and (len(values),) != fact.lengths):
        return None
    if isinstance(field.of, StructureType):
        parts = [field.of._put(fact.fields, one) for one in values]  # noqa: SLF001 - as above
        if any(part is None for part in parts):
            return None
        count = pack_uatype(ua.VariantType.Int32, len(parts)) if field.array else b""
        return b"".join([count, *(part for part in parts if part is not None)])
    if not all(fits(fact.kind, one) for one in values):
        return None
    packed: bytes = (
        pack_uatype_array(field.of, values) if field.array else pack_uatype(field.of, value)
    )
    return packed


def fields_of(
    definition: Any,  # noqa: ANN401 - a definition of any kind
    types: Mapping[str, "ua.VariantType | StructureType | None"],
) -> StructureType | None:
    """Return what takes values of a structure apart; ``None`` where robolink cannot.

    That is a union, a structure with optional fields, one with arrays of several dimensions, and
    one with a field of a type that is not in ``types``.

    Args:
        definition: As the server gives it.
        types: Of the fields, by the id of their type.
    """
    if (
        not isinstance(definition, ua.StructureDefinition)
        or definition.StructureType != ua.StructureType.Structure
        or not definition.Fields
    ):
        return None
    fields = []
    for field in definition.Fields:
        of = types.get(field.DataType.to_string())
        if of is None or field.ValueRank not in (-1, 1) or field.Name is None:
            return None
        fields.append(_Field(field.Name, of, field.ValueRank == 1))
    if len({field.name for field in fields}) != len(fields):
        return None
    return StructureType(definition.DefaultEncodingId, tuple(fields))


def type_ids(definition: Any) -> Iterator[ua.NodeId]:  # noqa: ANN401 - as above
    """Yield the ids of the types of a definition's fields."""
    if isinstance(definition, ua.StructureDefinition):
        yield from {
            field.DataType.to_string(): field.DataType for field in definition.Fields
        }.values()
