"""What printed statements show. Each only prints; they need Execute."""

import re
from collections.abc import Callable
from typing import Final, get_args

from robolink.controllers.epson.verify.interview import Interview
from robolink.controllers.epson.verify.verification import Fact, OptionValue
from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.protocols import spel

_LAST_TEXT: Final = re.compile(rb'#Execute,"[^"\r\n]+(\r\n|\r|\n)?"[\r\n]*$')
_COORDINATE: Final = re.compile(r"[XYZUVW]:( *-?[0-9]+\.[0-9]+)")
_WIDTHS: Final = (8, 9)
_WRAPPED_DEG: Final = 180.0

Reading = Callable[[str], tuple[str, OptionValue] | None]
"""From a printed text to what it shows and the option's value; ``None`` for neither."""


def closing_quote(interview: Interview) -> Fact:
    """Whether Print's own line end stands before the closing quote.

    Source: docs/reference/epson.md 1.5.
    """
    name, option = tr("line end of Print"), "print_crlf_inside_quotes"
    if interview.printed(spel.print_selected_tool()) is None:
        return Fact(name, interview.why_no_statement(), option)
    answer = _LAST_TEXT.search(interview.heard)
    if answer is None:
        return Fact(name, tr("no printed text was found"), option)
    inside = answer[1] is not None
    finding = tr("before the closing quote") if inside else tr("none before the closing quote")
    return Fact(name, finding, option, inside, repr(answer[0])[1:])


def number_lead_blank(interview: Interview) -> Fact:
    """Whether Print shows a blank before a number (docs/reference/epson.md 1.5)."""

    def read(text: str) -> tuple[str, OptionValue]:
        blank = text.startswith(" ")
        return tr("a blank") if blank else tr("nothing"), blank

    query, name = spel.print_selected_tool(), tr("before a printed number")
    return _fact(interview, query, name, "number_lead_blank", read)


def point_coordinates(interview: Interview) -> Fact:
    """Whether a point of four coordinates prints with six (docs/reference/epson.md 3.3)."""

    def read(text: str) -> tuple[str, OptionValue]:
        four = len(spel.parse_point(text).coordinates) == 4
        return (tr("as many as given"), "given") if four else (tr("always six"), "six")

    query = spel.print_plain_point()
    return _fact(interview, query, tr("coordinates of a printed point"), "point_coordinates", read)


def point_flags(interview: Interview) -> Fact:
    """Which flags stand behind a printed position (docs/reference/epson.md 7)."""

    def read(text: str) -> tuple[str, OptionValue]:
        return " ".join(f"/{flag}" for flag in spel.parse_point(text).flags) or tr("none"), ""

    return _fact(interview, spel.print_here(), tr("flags of a printed position"), "", read)


def where_width(interview: Interview) -> Fact:
    """How wide a value of Where is (docs/reference/epson.md 3.3)."""

    def read(text: str) -> tuple[str, OptionValue] | None:
        spel.parse_where(text)
        widths = {len(value) for value in _COORDINATE.findall(text)}
        width = min(widths, default=0)
        if len(widths) != 1 or width not in _WIDTHS:
            return None
        return tr("{width} columns", width=width), width

    return _fact(interview, spel.where(), tr("width of a value in Where"), "where_width", read)


def base(interview: Interview) -> Fact:
    """Where the base stands that positions count from (docs/reference/spel.md 5.4)."""

    def read(text: str) -> tuple[str, OptionValue] | None:
        place = spel.parse_base(text)
        if place is None:
            return None
        return (" ".join(f"{at:g}" for at in place) if any(place) else tr("that of the robot")), ""

    return _fact(interview, spel.show_base(), tr("base of positions (Base)"), "", read)


def comma_blank(interview: Interview) -> Fact:
    """What a comma in Print leaves between two texts (docs/reference/spel.md 3.2)."""

    def read(text: str) -> tuple[str, OptionValue] | None:
        shown = {"AB": (tr("nothing"), "numeric"), "A B": (tr("a blank"), "always")}
        return shown.get(text)

    query = spel.print_two_texts()
    return _fact(interview, query, tr("comma between two texts in Print"), "comma_blank", read)


def tool_facts(interview: Interview) -> tuple[Fact, ...]:
    """What the listing of the tools shows, and what the first of them does."""
    names = {
        "tool_listing": tr("layout of the tool listing"),
        "true_value": tr("True, printed"),
        "angle_wrap": tr("tool angles beyond 180 degrees"),
        "": tr("a number without a format"),
    }
    listing = interview.printed(spel.list_tools())
    if listing is None:
        why = interview.why_no_statement()
    else:
        try:
            tools = spel.parse_tool_listing(listing)
        except RemoteProtocolError as error:
            tools, why = {}, error.what
        else:
            why = "" if tools else tr("no tool is defined; define one and try again")
    if listing is None or why:
        return tuple(Fact(name, why, option) for option, name in names.items())
    first = min(tools)
    return (
        _layout(names["tool_listing"], listing, tools),
        _fact(interview, spel.print_tool_defined(first), names["true_value"], "true_value", _truth),
        _wrap(names["angle_wrap"], tools),
        _fact(interview, spel.print_tool_x(first), names[""], "", _digits),
    )


def _layout(name: str, listing: str, tools: dict[int, ToolOffset]) -> Fact:
    first = listing.splitlines()[0]
    fits = [
        layout
        for layout in get_args(spel.Layout)
        if spel.format_tool_listing(tools, layout=layout) == listing.rstrip("\r\n")
    ]
    if len(fits) == 1:
        return Fact(name, fits[0], "tool_listing", fits[0], first)
    return Fact(name, tr("none that is known: {line!r}", line=first), "tool_listing")


def _wrap(name: str, tools: dict[int, ToolOffset]) -> Fact:
    for tool, offset in tools.items():
        if any(abs(angle) > _WRAPPED_DEG for angle in offset.components()[3:]):
            evidence = tr("tool {tool}: U {u}", tool=tool, u=offset.u_deg)
            return Fact(name, tr("are kept"), "angle_wrap", False, evidence)
    return Fact(name, tr("no stored tool has one, and none is written"), "angle_wrap")


def _truth(text: str) -> tuple[str, OptionValue] | None:
    shown = text.strip()
    return (shown, int(shown)) if shown in ("1", "-1") else None


def _digits(text: str) -> tuple[str, OptionValue]:
    spel.parse_number(text)
    return tr("{count} decimals", count=len(text.strip().partition(".")[2])), ""


def _fact(
    interview: Interview, query: spel.Statement, name: str, option: str, read: Reading
) -> Fact:
    text = interview.printed(query)
    if text is None:
        return Fact(name, interview.why_no_statement(), option)
    try:
        found = read(text)
    except RemoteProtocolError:
        found = None
    if found is None:
        return Fact(name, tr("neither of what is known: {text!r}", text=text), option)
    finding, value = found
    return Fact(name, finding, option, value if option else None, repr(text))
