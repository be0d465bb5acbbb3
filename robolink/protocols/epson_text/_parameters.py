"""Cutting the text after a request's name into parameters; one rule for both ends."""

from typing import Final

from robolink.protocols.epson_text._commands import ParameterForm, RemoteCommand, ReplyShape

MAX_TEXT: Final = 4060
"""Most bytes of a statement, and of what it prints (docs/reference/epson.md 1.5)."""

QUOTE: Final = '"'


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
    if command.form is ParameterForm.STATEMENT:
        if QUOTE in payload:  # there is no escape for it (docs/reference/spel.md 1)
            return None
        payload = f"{QUOTE}{payload}{QUOTE}"
    missing = len(parameters) < command.min_parameters
    return None if missing or read_parameters(command, payload) != parameters else payload


def _read(command: RemoteCommand, payload: str) -> tuple[str, ...] | None:
    most = command.max_parameters
    match command.form:
        case ParameterForm.NUMBERS:
            numbers = tuple(text.strip() for text in payload.split(",")[:most])
            if command.bare and not any(numbers):
                return ()
            return numbers if all(map(_is_number, numbers)) else None
        case ParameterForm.PASSWORD:
            return (payload.partition(",")[0],)
        case ParameterForm.STATEMENT:
            return _read_statement(payload)
        case ParameterForm.VARIABLE:
            parts = _split_variable(payload)
            surplus_is_dropped = parts is not None and command.reply is ReplyShape.FIELDS
            return parts[:most] if parts is not None and surplus_is_dropped else parts


def _read_statement(payload: str) -> tuple[str, ...] | None:
    """Return what stands between the first quote, at the start, and the last.

    Quotes between are part of the statement; nothing is escaped (docs/reference/epson.md 1.5).
    """
    last = payload.rfind(QUOTE)
    if not payload.startswith(QUOTE) or last == 0:
        return None
    statement = payload[1:last]
    return (statement,) if len(statement) <= MAX_TEXT else None


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
