"""Cutting the text after a request's name into parameters; one rule for both ends."""

from typing import Final

from robolink.protocols.epson_text._commands import Command, ParameterForm

MAX_TEXT: Final = 4060
"""Most bytes of a statement, and of what it prints (epson.md 1.5)."""

QUOTE: Final = '"'


def split_parameters(command: Command, payload: str) -> tuple[str, ...] | None:
    """Return the parameters in ``payload``, ``None`` when they do not fit ``command``."""
    parameters = _split(command.form, payload)
    if parameters is None:
        return None
    fits = command.min_parameters <= len(parameters) <= command.max_parameters
    return parameters if fits else None


def _split(form: ParameterForm, payload: str) -> tuple[str, ...] | None:
    match form:
        case ParameterForm.NUMBERS:
            numbers = payload.split(",")
            return tuple(numbers) if all(map(_is_number, numbers)) else None
        case ParameterForm.PASSWORD:
            return (payload.partition(",")[0],)
        case ParameterForm.STATEMENT:
            statement = payload[1:-1]
            quoted = payload == f"{QUOTE}{statement}{QUOTE}"
            if not quoted or QUOTE in statement or len(statement) > MAX_TEXT:
                return None
            return (statement,)
        case ParameterForm.VARIABLE:
            return _split_variable(payload)


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
