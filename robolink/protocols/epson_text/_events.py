"""The messages of EPSON Remote Ethernet (docs/reference/epson.md 1.1, 1.2, 1.6)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Request:
    """``$Name[,parameter...]`` from the host.

    ``name`` keeps the case in which it was written, because the reply echoes it. For
    Execute the one parameter is the statement, without the quotes around it.
    """

    name: str
    parameters: tuple[str, ...] = ()

    def __repr__(self) -> str:
        # A password must not reach a log through a careless {request!r}.
        shown = "('***',)" if self.name.lower() == "login" else repr(self.parameters)
        return f"Request(name={self.name!r}, parameters={shown})"


@dataclass(frozen=True, slots=True)
class BadRequest:
    """A line that a device cannot take for a request, with the refusal it deserves.

    ``name`` is what to echo: the name if one could be read, else the received text
    (assumed; docs/reference/epson.md 1.6 marks it unverified).
    """

    name: str
    code: int


@dataclass(frozen=True, slots=True)
class Reply:
    """``#Name,field...`` from the device; ``text`` is set when the payload is quoted.

    A quoted payload is what an executed statement printed; line breaks inside it are kept.
    """

    name: str
    fields: tuple[str, ...] = ()
    text: str | None = None


@dataclass(frozen=True, slots=True)
class Refusal:
    """``!Name,code`` from the device."""

    name: str
    code: int


@dataclass(frozen=True, slots=True)
class EndOfStream:
    """The far side closed the connection between two messages."""


Event = Request | BadRequest | Reply | Refusal | EndOfStream
"""Whatever a codec can hand out."""
