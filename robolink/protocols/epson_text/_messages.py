"""One message between its event and its bytes, without its terminator; for both ends.

Messages are cut at the byte level before anything is decoded: in every encoding that the
codec admits, the bytes of ``# ! $ , "`` and of line ends never occur inside a longer
character. Whatever is written here, the other role reads back as the same event; what could not
be is refused. The text after a request's name is cut into parameters by one rule for both.
"""

import re
from functools import lru_cache
from typing import Final

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols.epson_text._commands import (
    COMMANDS,
    ParameterForm,
    RemoteCommand,
    ReplyShape,
    find_command,
)
from robolink.protocols.epson_text._events import BadRequest, ErrorCode, Refusal, Reply, Request

_STATEMENT: Final = ParameterForm.STATEMENT  # before Python 3.12 a member is found slowly

_MAX_TEXT: Final = 4060
"""Largest number of bytes of a statement, and of its printed output (docs/reference/epson.md 1.5).
"""

_QUOTE: Final = '"'

_UNDECODABLE: Final = "backslashreplace"
"""A byte outside the encoding stays visible as ``\\xNN`` and ends no session."""

_MAX_CODE_DIGITS: Final = 5
_MAX_CODE: Final = 99_999

_SHORT: Final = 32
"""Number of bytes kept of a request, to recognise the request later."""

_A_REQUEST: Final = rb"(\$(?:%s)(?=[,\r\n]))" % b"|".join(c.name.encode() for c in COMMANDS)
_BEHIND_REQUEST: Final = re.compile(_A_REQUEST, re.IGNORECASE)
_BEHIND_STATEMENT: Final = re.compile(rb'"' + _A_REQUEST, re.IGNORECASE)


@lru_cache(maxsize=256)
def read_answer(line: bytes, encoding: str) -> Reply | Refusal:
    """Read a device's message; a poll sees the same few answers over and over.

    Raises:
        RemoteProtocolError: It is neither a reply nor a refusal.
    """
    mark = line[:1]
    if mark == b"#":
        name, comma, payload = line[1:].partition(b",")
        if comma and name.isalnum():
            if payload[:1] == b'"':
                text = payload[1:-1].decode(encoding, _UNDECODABLE)
                return Reply(name.decode("ascii"), (), _without_line_end(text))
            fields = [field.decode(encoding, _UNDECODABLE) for field in payload.split(b",")]
            return Reply(name.decode("ascii"), tuple(fields))
    elif mark == b"!":
        # The name may repeat any text, including commas (docs/reference/epson.md 1.6).
        name, comma, code = line[1:].rpartition(b",")
        if comma and code.isdigit() and len(code) <= _MAX_CODE_DIGITS:
            return Refusal(name.decode(encoding, _UNDECODABLE), int(code))
    raise RemoteProtocolError(
        tr("{line!r} is not an answer of Remote Ethernet.", line=line[:80]),
        remedy=tr(
            "Check the port and the control device in the controller's setup, then connect again."
        ),
        raw=line,
    )


def read_request(line: bytes, encoding: str) -> Request | BadRequest:
    """Read a host's message; a senseless one becomes the refusal that it deserves."""
    if len(line) <= _SHORT and b"," not in line:
        return _read_bare_request(line, encoding)
    return _read_request(line, encoding)


@lru_cache(maxsize=256)
def _read_bare_request(line: bytes, encoding: str) -> Request | BadRequest:
    """Read one without parameters, so without a password; polls are always the same few."""
    return _read_request(line, encoding)


def _read_request(line: bytes, encoding: str) -> Request | BadRequest:
    text = line.decode(encoding, _UNDECODABLE)
    if text[:1] != "$":
        return BadRequest(_echo(text), ErrorCode.NO_DOLLAR)
    name, comma, payload = text[1:].partition(",")
    command = find_command(name)
    if command is None:
        return BadRequest(_echo(text[1:]), ErrorCode.UNKNOWN_COMMAND)
    if not comma and (command.min_parameters == 0 or command.bare):
        return Request(name)
    parameters = read_parameters(command, payload) if comma else None
    if parameters is None:
        return BadRequest(name, ErrorCode.MALFORMED)
    return Request(name, parameters)


def next_request(data: bytes | bytearray, start: int) -> int:
    """Return where, from ``start`` on, the next request begins in ``data``, -1 for nowhere.

    That is a ``$``, the name of a command, and what ends a name; a lone ``$`` ends names of
    strings. Blanks before a ``$`` are no request of their own. Behind an Execute it follows the
    closing quote, for a statement may print anything.
    """
    if data.find(b"$", start) < 0:
        return -1
    if data[:1].isspace():
        start = max(start, len(data) - len(data.lstrip(BLANKS)) + 1)
    pattern = _BEHIND_STATEMENT if data[:9].lower() == b"$execute," else _BEHIND_REQUEST
    found = pattern.search(data, start)
    return -1 if found is None else found.start(1)


BLANKS = b" \t"


def _echo(text: str) -> str:
    name = text.partition(",")[0]
    return name if name.isascii() and name.isalnum() else text


def _without_line_end(text: str) -> str:
    return text.removesuffix("\n").removesuffix("\r")


@lru_cache(maxsize=64)
def _bare_request(name: str) -> bytes:
    """Return the line of a request without parameters; empty where there is none by that name."""
    command = find_command(name)
    fits = command is not None and command.min_parameters == 0
    return f"${name}".encode("ascii") if fits else b""


def write_request(request: Request) -> bytes:
    """Return the line of a request.

    Raises:
        LocalProtocolError: Unknown command, wrong parameters, or text that the line cannot
            carry. No message repeats a password.
    """
    parameters = request.parameters
    if not parameters and (bare := _bare_request(request.name)):
        return bare
    command = find_command(request.name)
    if command is None:
        raise LocalProtocolError(
            tr("{name!r} is not a Remote Ethernet command.", name=request.name),
            remedy=tr("Use a command of the table in robolink.protocols.epson_text."),
        )
    written = ",".join(parameters)
    if not (written.isascii() and written.isprintable()):
        raise _refused(request, tr("it holds a character that is not printable ASCII"))
    payload = write_parameters(command, parameters)
    if payload is None:
        raise _refused(request, _misfit(command, parameters))
    return f"${request.name},{payload}".encode("ascii")


def write_reply(reply: Reply, encoding: str) -> bytes:
    """Return the message of a reply.

    Raises:
        LocalProtocolError: The host could not read it back as the same reply.
    """
    if not (reply.name.isascii() and reply.name.isalnum()):
        raise _unsendable(reply, tr("its name is not made of ASCII letters and digits"))
    if reply.text is None:
        return _written_fields(reply.name, reply.fields, encoding)
    if reply.fields:
        raise _unsendable(reply, tr("it has both fields and a text"))
    if '"\r' in reply.text or '"\n' in reply.text:
        raise _unsendable(reply, tr("a quote before a line end would end the text early"))
    text = _encoded(reply, reply.text, encoding)
    if len(text) > _MAX_TEXT:
        raise _unsendable(reply, tr("its text is longer than {limit} bytes", limit=_MAX_TEXT))
    return b'#%s,"%s"' % (reply.name.encode("ascii"), text)


@lru_cache(maxsize=256)
def _written_fields(name: str, fields: tuple[str, ...], encoding: str) -> bytes:
    """Write one without a text; a poll is given the same few over and over."""
    reply, payload = Reply(name, fields), ",".join(fields)
    if not fields or payload.count(",") != len(fields) - 1:
        raise _unsendable(reply, tr("it needs at least one field, and no comma in any"))
    if payload.startswith(_QUOTE) or _breaks_line(payload):
        raise _unsendable(reply, tr("a quote or a line end would be mistaken for a frame"))
    return _encoded(reply, f"#{name},{payload}", encoding)


def write_refusal(refusal: Refusal, encoding: str) -> bytes:
    """Return the line of a refusal.

    Raises:
        LocalProtocolError: The host could not read it back as the same refusal.
    """
    if not 0 <= refusal.code <= _MAX_CODE:
        raise _unsendable(refusal, tr("its code is not 0 to {limit}", limit=_MAX_CODE))
    if _breaks_line(refusal.name):
        raise _unsendable(refusal, tr("its name holds a line end"))
    return _encoded(refusal, f"!{refusal.name},{int(refusal.code)}", encoding)


def _misfit(command: RemoteCommand, parameters: tuple[str, ...]) -> str:
    if not command.min_parameters <= len(parameters) <= command.max_parameters:
        return tr(
            "it takes {least} to {most} parameters, not {count}",
            least=command.min_parameters,
            most=command.max_parameters,
            count=len(parameters),
        )
    match command.form:
        case ParameterForm.NUMBERS:
            return tr("its parameters must be whole numbers without a sign")
        case ParameterForm.PASSWORD:
            return tr("the controller would cut the password at its comma")
        case ParameterForm.VARIABLE:
            return tr("a comma or a parenthesis would split its parameters elsewhere")
        case ParameterForm.STATEMENT:
            return tr("a statement holds at most {limit} bytes and no quote", limit=_MAX_TEXT)


def _breaks_line(text: str) -> bool:
    return "\r" in text or "\n" in text


def _encoded(event: Reply | Refusal, text: str, encoding: str) -> bytes:
    try:
        return text.encode(encoding)
    except UnicodeEncodeError as error:
        why = tr("{encoding} lacks one of its characters", encoding=encoding)
        raise _unsendable(event, why) from error


def _refused(request: Request, why: str) -> LocalProtocolError:
    return LocalProtocolError(
        tr("{name} cannot be sent: {why}.", name=request.name, why=why),
        remedy=tr("Nothing was sent. Correct the parameters."),
        request=request.name,
    )


def _unsendable(event: Reply | Refusal, why: str) -> LocalProtocolError:
    return LocalProtocolError(
        tr("{event!r} cannot be sent: {why}.", event=event, why=why),
        remedy=tr("Nothing was sent. Correct the answer."),
    )


def read_parameters(command: RemoteCommand, payload: str) -> tuple[str, ...] | None:
    """Return the parameters in ``payload`` as a device takes them, ``None`` when it cannot.

    Clients in use send more than a command takes (``$Login,,terminator``, ``$GetStatus,``,
    ``$Reset,0``, ``$SetMotorsOn, 1``) and controllers were seen to answer; so blanks around a
    number are trimmed and surplus parameters are dropped unread, but for SetVariable
    (docs/reference/epson.md 1.10).
    """
    parameters = _read(command, payload)
    if parameters is None:
        return None
    fits = command.min_parameters <= len(parameters) <= command.max_parameters
    return parameters if fits or (command.bare and not parameters) else None


def write_parameters(command: RemoteCommand, parameters: tuple[str, ...]) -> str | None:
    """Return ``parameters`` as one text, ``None`` when a device could read anything else."""
    payload = ",".join(parameters)
    if command.form is _STATEMENT:
        if _QUOTE in payload:  # a quote cannot be escaped (docs/reference/spel.md 1)
            return None
        payload = f"{_QUOTE}{payload}{_QUOTE}"
    missing = len(parameters) < command.min_parameters
    return None if missing or read_parameters(command, payload) != parameters else payload


def _read(command: RemoteCommand, payload: str) -> tuple[str, ...] | None:
    if command.form is _STATEMENT:  # most are
        return _read_statement(payload)
    most = command.max_parameters
    match command.form:
        case ParameterForm.NUMBERS:
            numbers = tuple(text.strip() for text in payload.split(",")[:most])
            if command.bare and not any(numbers):
                return ()
            return numbers if all(map(_is_number, numbers)) else None
        case ParameterForm.PASSWORD:
            return (payload.partition(",")[0],)
        case ParameterForm.VARIABLE:
            parts = _split_variable(payload)
            surplus_is_dropped = parts is not None and command.reply is ReplyShape.FIELDS
            return parts[:most] if parts is not None and surplus_is_dropped else parts


def _read_statement(payload: str) -> tuple[str, ...] | None:
    """Return what stands between the first quote, at the start, and the last.

    Quotes between are part of the statement; nothing is escaped (docs/reference/epson.md 1.5).
    """
    last = payload.rfind(_QUOTE)
    if not payload.startswith(_QUOTE) or last == 0:
        return None
    statement = payload[1:last]
    return (statement,) if len(statement) <= _MAX_TEXT else None


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit()


def _split_variable(payload: str) -> tuple[str, ...] | None:
    """Cut ``name(i,j),rest...``: commas between the subscripts do not separate."""
    name, comma, rest = payload.partition(",")
    if "(" in name:
        subscripted, closing, tail = payload.partition(")")
        if not closing or tail[:1] not in ("", ","):
            return None
        name, comma, rest = subscripted + closing, tail[:1], tail[1:]
    if not name:
        return None
    return (name, *rest.split(",")) if comma else (name,)
