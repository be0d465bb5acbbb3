"""Requests as they stand on the wire, for a person to read."""

from collections.abc import Iterable

from robolink.protocols.epson_text import EpsonTextCodec, Request, Role
from robolink.protocols.spel import Statement


def as_sent(request: Request) -> str:
    """Return the line of a request."""
    return EpsonTextCodec(Role.HOST).send(request).decode("ascii").rstrip()


def executes(statements: Iterable[Statement]) -> tuple[str, ...]:
    """Return the lines that run statements."""
    return tuple(as_sent(Request("Execute", (statement,))) for statement in statements)
