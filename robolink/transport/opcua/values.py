"""Values of OPC UA as plain Python values, and back, each held against the node's own type.

Source: OPC 10000-6, 5.2 (built-in types, variants).
"""

import math
import struct
from collections.abc import Mapping
from itertools import chain
from typing import Any, Final

from asyncua import ua
from asyncua.common.utils import Buffer

_INTEGERS: Final[Mapping[str, tuple[int, int]]] = {
    "SByte": (-(1 << 7), (1 << 7) - 1),
    "Byte": (0, (1 << 8) - 1),
    "Int16": (-(1 << 15), (1 << 15) - 1),
    "UInt16": (0, (1 << 16) - 1),
    "Int32": (-(1 << 31), (1 << 31) - 1),
    "UInt32": (0, (1 << 32) - 1),
    "Int64": (-(1 << 63), (1 << 63) - 1),
    "UInt64": (0, (1 << 64) - 1),
}


_FLOATS: Final = {"Float": "<f", "Double": "<d"}


class BoundedBuffer(Buffer):  # type: ignore[misc]  # its types are not followed (pyproject.toml)
    """Bytes of a server; refuses two lengths with which asyncua would never come to an end.

    Those are negative ones, and arrays of elements that have no bytes, of which there may be two
    thousand million.
    """

    _OF_NOTHING: Final = (b"\x80", b"\xc0")
    """A variant that is an array of nulls, without and with dimensions."""

    _before = b""

    def read(self, size: int) -> bytes:
        """Take the next bytes; ``ValueError`` for a length that is refused."""
        if size < 0:
            message = f"a length of {size}"
            raise ValueError(message)
        data: bytes = super().read(size)
        if size == 4 and self._before in self._OF_NOTHING:
            count = int.from_bytes(data, "little", signed=True)
            if count > len(self):
                message = f"an array of {count} nulls"
                raise ValueError(message)
        self._before = data if size == 1 else b""
        return data

    def at_value(self) -> None:
        """Say that a value begins here, so that the byte before it opens no array."""
        self._before = b""

    def copy(self, size: int = -1) -> "BoundedBuffer":
        """Return the bytes that are left, or the first of them, without taking them."""
        whole = 0 <= size <= len(self)
        return BoundedBuffer(self._data, self._cur_pos, size if whole else len(self))


def shape(kind: str, lengths: tuple[int, ...]) -> str:
    """Return a type for display: ``Double``, ``UInt16[64]``."""
    return (kind or "-") + "".join(f"[{length}]" for length in lengths)


def decoded(variant: ua.Variant | None) -> tuple[str, tuple[int, ...], Any]:
    """Return kind, lengths and value of what a server sent.

    An array of several dimensions keeps them; one whose dimensions do not fit its number of
    elements has the length -1, which no node has.
    """
    if variant is None:
        return "", (), None
    kind = str(variant.VariantType.name)
    if not variant.is_array:
        return kind, (), variant.Value
    value = variant.Value or []
    lengths = tuple(variant.Dimensions or (len(value),))
    flat = value
    for _ in lengths[1:]:
        flat = list(chain.from_iterable(flat))
    # asyncua fills up what dimensions promise and the elements do not keep.
    if len(flat) != math.prod(lengths) or any(isinstance(one, list) for one in flat):
        return kind, (-1,), value
    return kind, lengths, value


def encoded(kind: str, lengths: tuple[int, ...], value: object) -> ua.Variant | None:
    """Return what is written to a node of this type; ``None`` where the value does not fit it."""
    flat = _flat(value, lengths)
    if flat is None or not all(fits(kind, one) for one in flat):
        return None
    own = getattr(ua.VariantType, kind)
    dimensions = list(lengths) if len(lengths) > 1 else None
    given = value if not lengths else _as_lists(value, len(lengths))
    return ua.Variant(given, own, dimensions, is_array=bool(lengths))


def _as_lists(value: Any, depth: int) -> list[Any]:  # noqa: ANN401 - nested
    return [_as_lists(one, depth - 1) for one in value] if depth > 1 else list(value)


def _flat(value: object, lengths: tuple[int, ...]) -> list[object] | None:
    """Return the elements in order; ``None`` where there are not as many as there have to be."""
    if not lengths:
        return [value]
    if not isinstance(value, list | tuple) or len(value) != lengths[0]:
        return None
    parts = [_flat(one, lengths[1:]) for one in value]
    if any(part is None for part in parts):
        return None
    return [one for part in parts for one in part or ()]


def fits(kind: str, value: object) -> bool:
    """Return whether a single value can be written as a built-in type, without being changed.

    A number for a ``Float`` is rounded to it.
    """
    if kind == "Boolean":
        return isinstance(value, bool)
    if kind == "String":
        return value is None or isinstance(value, str)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    if kind in _INTEGERS:
        low, high = _INTEGERS[kind]
        return isinstance(value, int) and low <= value <= high
    if kind not in _FLOATS:
        return False
    try:
        struct.pack(_FLOATS[kind], value)
    except (OverflowError, struct.error):
        return False
    return True
