"""Requests as they stand on the wire: for a person to read, and for a stop to judge.

What a request does is judged from the text that leaves, not from who sends it: one that nobody
thought of counts as acting, and is held back while a stop is in force.
"""

import re
from collections.abc import Iterable
from typing import Final

from robolink.protocols import Role
from robolink.protocols.epson_text import EpsonTextCodec, Request
from robolink.protocols.spel import Statement
from robolink.stop_latch import CommandClass

_CALM: Final = frozenset({"stop", "abort", "pause", "resetalm", "setmotorsoff"})
_SESSION: Final = frozenset({"login", "logout"})

_LOOKS: Final = re.compile(r"(Print .*|Where|TLSet|Base|Here|RealPos)", re.ASCII)
_RESTORES: Final = re.compile(r"(Tool [0-9]+|Power (Low|High)|SpeedS? [0-9., ]+)", re.ASCII)
_WRITES: Final = re.compile(r"(TLSet [0-9]+, XY\([^()]*\)|TLClr [0-9]+)", re.ASCII)


def command_class_of(request: Request) -> CommandClass:
    """Return what ``request`` does.

    Statements are those of :mod:`robolink.protocols.spel`; one that a person typed, and several in
    one (``;``), count as acting unless they have exactly the form of one that does not.
    """
    name = request.name.lower()
    if name.startswith("get") or name in _SESSION:
        return CommandClass.LOOK
    if name == "reset":
        return CommandClass.RESET
    if name in _CALM:
        return CommandClass.CALM
    if name == "execute" and request.parameters:
        return _of_statement(request.parameters[0])
    return CommandClass.ACT


def _of_statement(statement: str) -> CommandClass:
    if ";" in statement:
        return CommandClass.ACT
    if _LOOKS.fullmatch(statement):
        return CommandClass.LOOK
    if _RESTORES.fullmatch(statement):
        return CommandClass.RESTORE
    if _WRITES.fullmatch(statement):
        return CommandClass.WRITE
    return CommandClass.ACT


def as_sent(request: Request) -> str:
    """Return the line of a request."""
    return EpsonTextCodec(Role.HOST).send(request).decode("ascii").rstrip()


def executes(statements: Iterable[Statement]) -> tuple[str, ...]:
    """Return the lines that run statements."""
    return tuple(as_sent(Request("Execute", (statement,))) for statement in statements)
