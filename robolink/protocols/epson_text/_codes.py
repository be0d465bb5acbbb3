"""The error codes of Remote Ethernet (docs/reference/epson.md 1.6)."""

from enum import IntEnum

from robolink.messages import tr


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
