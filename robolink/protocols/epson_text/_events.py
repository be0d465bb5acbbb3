"""The messages of EPSON Remote Ethernet, and the codes of its refusals.

Source: docs/reference/epson.md 1.1, 1.2, 1.6.
"""

from dataclasses import dataclass
from enum import IntEnum

from robolink.messages import tr


@dataclass(frozen=True, slots=True)
class Request:
    """``$Name[,parameter...]`` from the host.

    ``name`` keeps the case in which it was written, because the reply echoes it. For
    Execute the one parameter is the statement, without the quotes around it.
    """

    name: str
    parameters: tuple[str, ...] = ()

    def __repr__(self) -> str:
        # A careless {request!r} must not write a password to a log.
        shown = "('***',)" if self.name.lower() == "login" else repr(self.parameters)
        return f"Request(name={self.name!r}, parameters={shown})"


@dataclass(frozen=True, slots=True)
class BadRequest:
    """A line that a device cannot read as a request, with the refusal it deserves.

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


@dataclass(frozen=True, slots=True)
class Opening:
    """EOT on a serial line: the host turns Remote RS232 on, or begins anew.

    Source: docs/reference/epson.md 2.1.
    """


Event = Request | BadRequest | Reply | Refusal | Opening | EndOfStream
"""Any event of a codec."""


class ErrorCode(IntEnum):
    """The number behind ``!Name,``. SPEL+ error numbers are other numbers."""

    NO_DOLLAR = 10
    UNKNOWN_COMMAND = 11
    MALFORMED = 12
    WRONG_PASSWORD = 13
    BAD_COUNT = 14
    NO_SUCH_VARIABLE = 15
    CHECKSUM = 16
    TIMED_OUT = 19
    NOT_READY = 20
    EXECUTE_RUNNING = 21
    PASSWORD_REQUIRED = 98
    SYSTEM = 99

    @property
    def meaning(self) -> str:
        """The code in words, without a full stop."""
        meanings = {
            ErrorCode.NO_DOLLAR: tr("the request does not start with $"),
            ErrorCode.UNKNOWN_COMMAND: tr("unknown command, or not logged in"),
            ErrorCode.MALFORMED: tr("malformed request"),
            ErrorCode.WRONG_PASSWORD: tr("wrong password"),
            ErrorCode.BAD_COUNT: tr("element count missing or not 1 to 100, or a String array"),
            ErrorCode.NO_SUCH_VARIABLE: tr("no such variable, or an index out of range"),
            ErrorCode.CHECKSUM: tr("checksum mismatch on the serial line"),
            ErrorCode.TIMED_OUT: tr("the request timed out"),
            ErrorCode.NOT_READY: tr("the controller is not in the state that this needs"),
            ErrorCode.EXECUTE_RUNNING: tr("an Execute is still running"),
            ErrorCode.PASSWORD_REQUIRED: tr("a public IP address demands a password"),
            ErrorCode.SYSTEM: tr("system or communication error"),
        }
        return meanings[self]
