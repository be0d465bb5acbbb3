"""A request that the simulated controller answers with ``!Name,code``."""

from typing import Final

from robolink.protocols.epson_text import ErrorCode

_MOST_DIGITS: Final = 9


class RequestRefused(Exception):
    """Nothing was carried out.

    Attributes:
        code: What is answered (docs/reference/epson.md 1.6).
    """

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def malformed() -> RequestRefused:
    """Return the refusal of a parameter that makes no sense."""
    return RequestRefused(ErrorCode.MALFORMED)


def number(text: str, most: int | None = None) -> int:
    """Return an unsigned parameter as a number.

    Raises:
        Refused: It is larger than ``most``, or than any number that the controller knows.
    """
    if len(text) > _MOST_DIGITS or not text.isdecimal():
        raise malformed()
    value = int(text)
    if most is not None and value > most:
        raise malformed()
    return value
