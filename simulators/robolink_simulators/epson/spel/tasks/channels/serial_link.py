"""A serial line as a port of a program has it: bytes out, and those that are there."""

from dataclasses import dataclass
from typing import Any, Final, Literal

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

COM_NUMBERS: Final = (*range(1, 5), *range(1001, 1009))
"""Of the controller, and of the PC (docs/reference/spel.md 17)."""


@dataclass(frozen=True, slots=True)
class SerialFormat:
    """What SetCom says of the characters.

    Attributes:
        baud: Bits per second.
        data_bits: 7 or 8.
        stop_bits: 1 or 2.
        parity: None, odd or even.
    """

    baud: int = 9600
    data_bits: int = 8
    stop_bits: int = 1
    parity: Literal["N", "O", "E"] = "N"


class SerialLink:
    """A serial line that answers as a socket does which does not block.

    Args:
        number: Of the port, for messages.
        device: The line: a port of this machine that was named for the program.
        form: How its characters are.

    Raises:
        Refusal: It cannot be opened.
    """

    def __init__(self, number: int, device: str, form: SerialFormat) -> None:
        import serial

        try:
            self._line: Any = serial.Serial(
                device,
                form.baud,
                bytesize=form.data_bits,
                stopbits=form.stop_bits,
                parity=form.parity,
                timeout=0,
                write_timeout=1.0,
                exclusive=True,
            )
        except (OSError, ValueError) as error:
            raise SpelRefusal(RefusalKind.PORT_IN_USE, f"Port {number}: {error}") from error

    def recv(self, most: int) -> bytes:
        """Return bytes that have come.

        Raises:
            BlockingIOError: None are there.
            OSError: The line is gone.
        """
        data: bytes = self._line.read(most)
        if not data:
            raise BlockingIOError
        return data

    def sendall(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            OSError: The line does not take them.
        """
        self._line.write(data)

    def settimeout(self, seconds: float) -> None:
        """Keep the time that it was opened with."""

    def setblocking(self, blocking: bool) -> None:
        """Keep to not blocking."""

    def close(self) -> None:
        """Give the line back."""
        self._line.close()
