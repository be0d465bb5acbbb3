"""Lengths and angles in lines: whole thousandths of a millimetre or degree.

That is the last digit which the controller prints, and what is sent is what is compared
(docs/reference/spel.md 5).
"""

import re
from collections.abc import Sequence
from typing import Final

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import ToolOffset

COMPONENTS: Final = 6
_LARGEST: Final = 9_999_999
_WHOLE: Final = re.compile(r"-?[0-9]{1,7}")


def offset_fields(offset: ToolOffset) -> tuple[str, ...]:
    """Return the six fields of an offset.

    Raises:
        LocalProtocolError: It is too large.
    """
    return tuple(_field(value) for value in offset.components())


def tool_fields(offset: ToolOffset | None) -> tuple[str, ...]:
    """Return the seven fields of a tool: 1 if it is defined, and its value."""
    return ("0" if offset is None else "1", *offset_fields(offset or ToolOffset()))


def read_components(fields: Sequence[str]) -> tuple[float, ...]:
    """Return six lengths and angles, mm and degrees.

    Raises:
        RemoteProtocolError: They are none.
    """
    return _read(fields, COMPONENTS)


def read_place(fields: Sequence[str]) -> tuple[float, ...]:
    """Return X and Y of a place, mm.

    Raises:
        RemoteProtocolError: They are none.
    """
    return _read(fields, 2)


def _read(fields: Sequence[str], count: int) -> tuple[float, ...]:
    if len(fields) != count or not all(map(_WHOLE.fullmatch, fields)):
        raise RemoteProtocolError(
            tr(
                "{fields} are not {count} whole numbers of thousandths.",
                fields=",".join(fields),
                count=count,
            )
        )
    return tuple(int(field) / 1000 for field in fields)


def read_tool(fields: Sequence[str]) -> ToolOffset | None:
    """Return what :func:`tool_fields` was given, rounded.

    Raises:
        RemoteProtocolError: It is no tool.
    """
    values = read_components(fields[1:])
    if fields[0] not in ("0", "1"):
        raise RemoteProtocolError(tr("{field!r} is neither 0 nor 1.", field=fields[0]))
    return ToolOffset(*values) if fields[0] == "1" else None


def same_thousandths(one: ToolOffset | None, other: ToolOffset | None) -> bool:
    """Tell whether two tools are the same where the controller prints them."""
    return tool_fields(one) == tool_fields(other)


def _field(value: float) -> str:
    thousandths = round(value * 1000)
    if abs(thousandths) > _LARGEST:
        raise LocalProtocolError(tr("{value:g} is too large for a line.", value=value))
    return str(thousandths)
