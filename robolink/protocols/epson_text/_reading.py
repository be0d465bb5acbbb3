"""From one message to one event.

Messages are cut at the byte level before anything is decoded: in every encoding that the
codec admits, the bytes of ``# ! $ , "`` and of line ends never occur inside a longer
character.
"""

import re
from functools import lru_cache
from typing import Final

from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.protocols.epson_text._codes import ErrorCode
from robolink.protocols.epson_text._commands import COMMANDS, find_command
from robolink.protocols.epson_text._events import BadRequest, Refusal, Reply, Request
from robolink.protocols.epson_text._parameters import read_parameters

_UNDECODABLE: Final = "backslashreplace"
"""A byte outside the encoding stays visible as ``\\xNN`` and ends no session."""

_MAX_CODE_DIGITS: Final = 5

_A_REQUEST: Final = rb"(\$(?:%s)(?=[,\r\n]))" % b"|".join(c.name.encode() for c in COMMANDS)
_BEHIND_REQUEST: Final = re.compile(_A_REQUEST, re.IGNORECASE)
_BEHIND_STATEMENT: Final = re.compile(rb'"' + _A_REQUEST, re.IGNORECASE)


@lru_cache(maxsize=256)
def read_answer(line: bytes, encoding: str) -> Reply | Refusal:
    """Read what a device sends; a poll sees the same few answers over and over.

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
        # The name may be an echo of anything, commas included (docs/reference/epson.md 1.6).
        name, comma, code = line[1:].rpartition(b",")
        if comma and code.isdigit() and len(code) <= _MAX_CODE_DIGITS:
            return Refusal(name.decode(encoding, _UNDECODABLE), int(code))
    raise RemoteProtocolError(
        tr("{line!r} is no answer of Remote Ethernet.", line=line[:80]),
        remedy=tr(
            "Check the port and the control device in the controller's setup, then connect again."
        ),
        raw=line,
    )


def read_request(line: bytes, encoding: str) -> Request | BadRequest:
    """Read what a host sends; what makes no sense becomes the refusal it deserves."""
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
    strings. Behind an Execute it follows the closing quote, for a statement may print anything.
    """
    pattern = _BEHIND_STATEMENT if data[:9].lower() == b"$execute," else _BEHIND_REQUEST
    found = pattern.search(data, start)
    return -1 if found is None else found.start(1)


def _echo(text: str) -> str:
    name = text.partition(",")[0]
    return name if name.isascii() and name.isalnum() else text


def _without_line_end(text: str) -> str:
    return text.removesuffix("\n").removesuffix("\r")
