"""What the requests and their answers show. Allowed at any time, production included.

What printed statements show. Each only prints; they need Execute.

What Remote RS232 leaves open, asked at rest (docs/reference/epson.md 2).
"""

import re
from collections.abc import Callable
from typing import Final, get_args

from robolink.controllers.epson.verify.verification import Fact, Interview, OptionValue
from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.protocols import spel
from robolink.protocols.epson_binary import Dialect
from robolink.protocols.epson_text import ErrorCode, Preference, parse_preferences

_STATUS: Final = re.compile(rb"#GetStatus,[01]+,[0-9]{4}(\r\n|\r|\n)")
_TERMINATORS: Final = {b"\r\n": "crlf", b"\r": "cr", b"\n": "lf"}
_COMMAND_SETS: Final = (5, 7, 8)


def status_flags(interview: Interview) -> Fact:
    """How many flags GetStatus prints (docs/reference/epson.md 1.4)."""
    name = tr("flags in GetStatus")
    fields = interview.ask("GetStatus")
    if isinstance(fields, int) or len(fields[0]) not in (10, 11):
        return Fact(name, tr("neither 10 nor 11"), "status_flags")
    count = len(fields[0])
    return Fact(name, tr("{count}", count=count), "status_flags", count, ",".join(fields))


def case_echo(interview: Interview) -> Fact:
    """Whether an answer repeats the name as it was written (docs/reference/epson.md 1.1)."""
    echoed = interview.echo("getstatus")
    same = tr("as it was written") if echoed == "getstatus" else tr("in its own spelling")
    return Fact(tr("name in an answer"), same, evidence=f"$getstatus -> #{echoed}")


def extended_queries(interview: Interview) -> Fact:
    """Whether the firmware knows GetContVer and its kin (docs/reference/epson.md 1.8)."""
    name, option = tr("extended queries"), "extended_queries"
    answer = interview.ask("GetContVer")
    if not isinstance(answer, int):
        return Fact(name, tr("known"), option, True, f"GetContVer -> {','.join(answer)}")
    if answer == ErrorCode.UNKNOWN_COMMAND:
        return Fact(name, tr("unknown"), option, False, f"GetContVer -> {answer}")
    return Fact(name, tr("refused with code {code}", code=answer), option)


def command_set(interview: Interview) -> Fact:
    """Which RC+ the commands belong to, from the version or the alarms.

    Source: docs/reference/epson.md 1.9.
    """
    name, option = tr("command set of RC+"), "rc_plus"
    version = interview.ask("GetContVer")
    if not isinstance(version, int):
        shown = ",".join(version).strip()
        major = shown.partition(".")[0]
        if major.isdecimal() and int(major) in _COMMAND_SETS:
            return Fact(name, major, option, int(major), f"GetContVer -> {shown}")
    alarms = interview.ask("GetAlm")
    if alarms == ErrorCode.UNKNOWN_COMMAND:
        return Fact(name, tr("5: no alarms yet"), option, 5, f"GetAlm -> {alarms}")
    return Fact(name, tr("7 or 8: the firmware does not say its version"), option)


def preferences(interview: Interview) -> tuple[Fact, ...]:
    """The preferences that matter for tools (docs/reference/epson.md 1.11)."""
    names = {
        Preference.RESET_OUTPUTS_OFF: (tr("Reset switches outputs off"), "reset_outputs_off"),
        Preference.OUTPUTS_OFF_AT_ESTOP: (
            tr("an emergency stop switches outputs off"),
            "outputs_off_at_estop",
        ),
        Preference.DRY_RUN: (tr("dry run"), "dry_run"),
        Preference.VIRTUAL_IO: (tr("virtual I/O"), "virtual_io"),
        Preference.MAINTENANCE_DATA: (tr("maintenance data"), "maintenance_data"),
    }
    answer = interview.ask("GetContSettings")
    if isinstance(answer, int):
        why = tr("this firmware does not tell its preferences: look at the controller's setup")
        return tuple(Fact(name, why, option) for name, option in names.values())
    told = ",".join(answer)
    try:
        on = parse_preferences(told)
    except RemoteProtocolError as error:
        return tuple(Fact(name, error.what, option) for name, option in names.values())
    return tuple(
        Fact(
            name,
            tr("on") if preference in on else tr("off"),
            option,
            preference in on,
            f"GetContSettings -> {told}",
        )
        for preference, (name, option) in names.items()
    )


def terminator(interview: Interview) -> Fact:
    """Which line end the controller sends (docs/reference/epson.md 1.1)."""
    name, option = tr("line end"), "terminator"
    ends = {match[1] for match in _STATUS.finditer(interview.heard)}
    if len(ends) != 1:
        return Fact(name, tr("not the same in every answer"), option)
    (end,) = ends
    return Fact(name, _TERMINATORS[end].upper(), option, _TERMINATORS[end], repr(end)[1:])


def unfinished_request(early: bool | None) -> Fact:
    """Whether a request without its line end is served (docs/reference/epson.md 1.1)."""
    name, option = tr("request without its line end"), "requests_end_with_silence"
    if early is None:
        return Fact(name, tr("not tried: Logout could stop a program"), option)
    finding = tr("is answered") if early else tr("is waited for")
    evidence = "$Logout -> #Logout" if early else tr("no answer within half a second")
    return Fact(name, finding, option, early, evidence)


_LAST_TEXT: Final = re.compile(rb'#Execute,"[^"\r\n]+(\r\n|\r|\n)?"[\r\n]*$')
_COORDINATE: Final = re.compile(r"[XYZUVW]:( *-?[0-9]+\.[0-9]+)")
_WIDTHS: Final = (8, 9)
_WRAPPED_DEG: Final = 180.0

Reading = Callable[[str], tuple[str, OptionValue] | None]
"""Returns what a printed text shows and the option's value; ``None`` if it shows neither."""


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
    """Where the base is, from which positions count (docs/reference/spel.md 5.4)."""

    def read(text: str) -> tuple[str, OptionValue] | None:
        place = spel.parse_base(text)
        if place is None:
            return None
        return (" ".join(f"{at:g}" for at in place) if any(place) else tr("that of the robot")), ""

    return _fact(interview, spel.show_base(), tr("base of positions (Base)"), "", read)


def comma_blank(interview: Interview) -> Fact:
    """What a comma in Print leaves between two texts (docs/reference/spel.md 3.2)."""

    def read(text: str) -> tuple[str, OptionValue] | None:
        shown: dict[str, tuple[str, OptionValue]] = {
            "A B": (tr("a blank"), "always"),
            "A, B": (tr("a comma and a blank"), "comma"),
            "A\tB": (tr("a tabulator"), "tab"),
        }
        if text == "AB":
            numbers = interview.printed(spel.print_known_numbers())
            gap = spel.gap_in_known_numbers(numbers or "")
            return tr("nothing"), "nothing" if gap is None else "numeric"
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
    return Fact(name, tr("none of the known forms: {line!r}", line=first), "tool_listing")


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
        return Fact(name, tr("not one of the known forms: {text!r}", text=text), option)
    finding, value = found
    return Fact(name, finding, option, value if option else None, repr(text))


_NO_SUCH_BIT: Final = "65535"
_CODES: Final = range(ErrorCode.NO_DOLLAR, ErrorCode.SYSTEM + 1)


def serial_facts(interview: Interview, dialect: Dialect) -> tuple[Fact, ...]:
    """Find out which frames and letters this controller takes.

    Args:
        interview: Asks it.
        dialect: As the line was opened.
    """
    return (
        _numbers(interview, dialect),
        _status_flags(interview),
        _nak_code(interview, dialect),
        _abort(interview),
        *_not_asked(),
    )


def _numbers(interview: Interview, dialect: Dialect) -> Fact:
    """Both ends write them alike, else the line would not have been opened."""
    answer = interview.ask("GetCurRobot")
    evidence = f"GetCurRobot -> {answer if isinstance(answer, int) else ','.join(answer)}"
    name, value = tr("numbers on the serial line"), dialect.numbers.value
    return Fact(name, value, "rs232_numbers", value, evidence)


def _status_flags(interview: Interview) -> Fact:
    name, option = tr("flags in GetStatus"), "rs232_status_flags"
    fields = interview.ask("GetStatus")
    if isinstance(fields, int):
        return Fact(name, tr("refused with code {code}", code=fields), option)
    count = len(fields[0])
    return Fact(name, tr("{count}", count=count), option, count, ",".join(fields))


def _nak_code(interview: Interview, dialect: Dialect) -> Fact:
    """A bit that no controller has is refused; the code shows how codes are written."""
    name = tr("code of a refusal")
    code = interview.ask("GetIO", _NO_SUCH_BIT)
    if not isinstance(code, int):
        return Fact(name, tr("not seen: bit {bit} exists", bit=_NO_SUCH_BIT), "rs232_nak_code")
    evidence = f"GetIO {_NO_SUCH_BIT} -> {code}"
    if code not in _CODES:
        finding = tr("is not possible: set nak_code=digits in the URL")
        return Fact(name, finding, "rs232_nak_code", evidence=evidence)
    return Fact(name, dialect.nak_code.value, "rs232_nak_code", dialect.nak_code.value, evidence)


def _abort(interview: Interview) -> Fact:
    """With nothing running there is nothing that Abort could end."""
    name, option = tr("letter A for Abort"), "rs232_letters"
    if why := interview.why_no_statement():
        return Fact(name, tr("not tried: {why}", why=why), option)
    answer = interview.ask("Abort")
    if not isinstance(answer, int):
        return Fact(name, tr("is understood: letters=guessed"), option, "guessed", "A -> ACK")
    finding = tr("is not understood: movements stay refused on this line")
    return Fact(name, finding, option, "documented", f"A -> NAK {answer}")


def _not_asked() -> tuple[Fact, ...]:
    ports = tr("not tried: a wrong length is an error that cannot be told from others")
    opening = tr("not seen: robolink discards any answer to EOT")
    return (
        Fact(tr("number of a port of words"), ports, "rs232_word_port_bytes"),
        Fact(tr("answer to EOT"), opening, "rs232_eot_answer"),
    )
