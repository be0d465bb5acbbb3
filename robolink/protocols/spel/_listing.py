"""The listing of ``TLSet`` (docs/reference/epson.md 3.1, docs/reference/spel.md 6.1).

Its columns are not documented. What Epson's own sample relies on: a line per defined tool,
``Tool``, the number, a colon, and numbers between commas with any blanks.
"""

import re
from collections.abc import Mapping
from typing import Final, Literal

from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.protocols.spel._numbers import NUMBER, decimal, unreadable

_LINE: Final = re.compile(
    rf"\s*tool\s*([0-9]{{1,2}})\s*:\s*({NUMBER}(?:\s*,\s*{NUMBER}){{3}}(?:\s*,\s*{NUMBER}\s*,\s*{NUMBER})?)\s*",
    re.ASCII | re.IGNORECASE,
)
_HIGHEST_TOOL: Final = 15

Layout = Literal["plain", "padded", "four"]
"""How a simulated controller lists tools; see :func:`format_tool_listing`."""


def parse_tool_listing(text: str) -> dict[int, ToolOffset]:
    """Read the defined tools; a text without the word Tool lists none.

    Four values are X Y Z in mm and U in degrees; six add V and W. Once a tool is listed,
    every line must be one: a line skipped could be the rest of a value.

    Raises:
        RemoteProtocolError: A line cannot be read, or a tool is listed twice.
    """
    tools: dict[int, ToolOffset] = {}
    if "tool" not in text.lower():
        return tools
    for line in text.replace("\r", "\n").split("\n"):
        if not line.strip():
            continue
        match = _LINE.fullmatch(line)
        number = int(match[1]) if match else -1
        if match is None or number > _HIGHEST_TOOL or number in tools:
            raise unreadable(tr("a list of tools"), text)
        tools[number] = ToolOffset(*(float(value) for value in match[2].split(",")))
    return tools


def format_tool_listing(tools: Mapping[int, ToolOffset], *, layout: Layout = "plain") -> str:
    """Return the listing of ``tools``; the twin of :func:`parse_tool_listing`.

    Args:
        tools: The defined tools by number.
        layout: ``plain`` as ``Tool 1: 12.000, -3.250, ...`` (the likeliest,
            docs/reference/spel.md 6.1), ``padded`` with values nine columns wide, ``four`` without
            V and W, which such a controller cannot show.
    """
    return "\r\n".join(_line(tool, tools[tool], layout) for tool in sorted(tools))


def _line(tool: int, offset: ToolOffset, layout: Layout) -> str:
    values = [decimal(value) for value in offset.components()]
    if layout == "four":
        values = values[:4]
    if layout == "padded":
        values = [value.rjust(9) for value in values]
    return f"Tool {tool}: " + ", ".join(values)
