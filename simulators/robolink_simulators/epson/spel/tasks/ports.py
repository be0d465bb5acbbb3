"""TCP/IP ports 201 to 216 on sockets of this machine, and serial ports (docs/reference/spel.md 17).

Only this machine is reached, and of its serial lines those alone that were named for the program:
a program under test must not find its way to a real cell.
"""

import ipaddress
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import LONGEST_STRING, out_of_range

if TYPE_CHECKING:
    from robolink_simulators.epson.spel.tasks.task import SpelTask


COM_NUMBERS: Final = (*range(1, 5), *range(1001, 1009))
"""Numbers of the COM ports of the controller and of the PC (docs/reference/spel.md 17)."""


@dataclass(frozen=True, slots=True)
class SerialFormat:
    """The format of the characters, from SetCom.

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
    """A serial line that answers like a non-blocking socket.

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


NUMBERS: Final = range(201, 217)
LONGEST_LINE: Final = 1024
_MOST_BYTES: Final = 65536
_ENCODING: Final = "latin-1"

Address = tuple[str, int]


class PortLink(Protocol):
    """What a port needs of a connection: the methods of a socket."""

    def setblocking(self, flag: bool, /) -> None:
        """See ``socket.socket.setblocking``."""

    def settimeout(self, value: float | None, /) -> None:
        """See ``socket.socket.settimeout``."""

    def getsockopt(self, level: int, name: int, /) -> int:
        """See ``socket.socket.getsockopt``."""

    def getpeername(self) -> object:
        """See ``socket.socket.getpeername``; raises OSError while there is no other end."""

    def sendall(self, data: bytes, /) -> None:
        """See ``socket.socket.sendall``."""

    def recv(self, most: int, /) -> bytes:
        """See ``socket.socket.recv``; raises BlockingIOError while nothing has come."""

    def close(self) -> None:
        """See ``socket.socket.close``."""


def dialled(address: Address) -> PortLink:
    """Return a socket that is being connected."""
    link = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    link.setblocking(False)
    link.connect_ex(address)
    return link


@dataclass(slots=True)
class PortSettings:
    """The settings of a port, from SetNet.

    Attributes:
        address: Host and TCP port.
        terminator: What ends a line.
        timeout_s: How long a read waits, 0 for ever.
        form: How the characters of a serial line are.
    """

    address: Address
    terminator: bytes = b"\r\n"
    timeout_s: float = 0.0
    form: SerialFormat = field(default_factory=SerialFormat)


@dataclass(slots=True)
class _Port:
    settings: PortSettings | None = None
    owner: "SpelTask | None" = None
    listener: socket.socket | None = None
    link: PortLink | SerialLink | None = None
    connected: bool = False
    received: bytearray = field(default_factory=bytearray)

    @property
    def is_open(self) -> bool:
        return self.listener is not None or self.link is not None

    def close(self) -> None:
        for end in (self.listener, self.link):
            if end is not None:
                end.close()
        self.listener = self.link = self.owner = None
        self.connected = False
        self.received.clear()


class Ports:
    """The ports of a controller.

    Args:
        addresses: Where ports lead whatever SetNet says: a test puts free ports here.

    Attributes:
        addresses: Where ports lead whatever SetNet says: a test puts free ports here.
        devices: The serial line of each serial port that has one.
        dial: Connects a port that is a client; what stands in for a network is put here.
    """

    def __init__(self, addresses: Mapping[int, Address] | None = None) -> None:
        self.addresses = dict(addresses or {})
        self.dial: Callable[[Address], PortLink] = dialled
        self._ports = {number: _Port() for number in (*NUMBERS, *COM_NUMBERS)}
        self.devices: dict[int, str] = {}

    def configure(self, number: int, settings: PortSettings) -> None:
        """Carry SetNet out.

        Raises:
            Refusal: The port is open, or leads to another machine.
        """
        port = self._port(number)
        if port.is_open:
            raise SpelRefusal(RefusalKind.PORT_OPEN_ALREADY, f"Port {number} is open")
        port.settings = settings

    def timeout_s(self, number: int) -> float:
        """Return how long a read waits, 0 for ever."""
        settings = self._port(number).settings
        return 0.0 if settings is None else settings.timeout_s

    def open(self, number: int, task: "SpelTask", *, server: bool) -> None:
        """Carry OpenNet out; it does not wait for the other end.

        Raises:
            Refusal: It is open already, was never set, or cannot be opened.
        """
        port = self._port(number)
        if port.is_open:
            raise SpelRefusal(RefusalKind.PORT_OPEN_ALREADY, f"Port {number} is open")
        host, tcp_port = self._address(number, port)
        try:
            if server:
                port.listener = socket.create_server((host, tcp_port))
                port.listener.setblocking(False)
            else:
                port.link = self.dial((host, tcp_port))
        except OSError as error:
            port.close()
            raise SpelRefusal(RefusalKind.PORT_IN_USE, f"Port {number}: {error}") from error
        port.owner = task

    def open_line(self, number: int, task: "SpelTask") -> None:
        """Carry OpenCom out.

        Raises:
            Refusal: It is open already, no line was named for it, or it cannot be opened.
        """
        port = self._port(number)
        if port.is_open:
            raise SpelRefusal(RefusalKind.PORT_OPEN_ALREADY, f"Port {number} is open")
        if number not in self.devices:
            raise SpelRefusal(RefusalKind.PORT_UNSET, f"Port {number} has no serial line")
        form = SerialFormat() if port.settings is None else port.settings.form
        port.link = SerialLink(number, self.devices[number], form)
        port.owner, port.connected = task, True

    def close(self, number: int) -> None:
        """Carry CloseNet or CloseCom out; a port that is not open may be closed (seen)."""
        self._port(number).close()

    def close_of(self, task: "SpelTask") -> None:
        """Close the ports of a task."""
        for port in self._ports.values():
            if port.owner is task:
                port.close()

    def close_all(self) -> None:
        """Close every port."""
        for port in self._ports.values():
            port.close()

    @property
    def in_use(self) -> bool:
        """Whether any port is open: then real time matters."""
        return any(port.is_open for port in self._ports.values())

    def connected(self, number: int) -> bool:
        """Return whether the other end exists.

        Raises:
            Refusal: The port is not open.
        """
        port = self._port(number)
        if not port.is_open:
            raise SpelRefusal(RefusalKind.PORT_NOT_OPEN, f"Port {number} is not open")
        self._attend(number, port)
        return port.connected

    def waiting_bytes(self, number: int, task: "SpelTask") -> int:
        """Return ChkNet: bytes received; -1 not connected, -2 of another task, -3 not open."""
        port = self._port(number)
        if not port.is_open:
            return -3
        if port.owner is not task:
            return -2
        self._attend(number, port)
        return len(port.received) if port.connected or port.received else -1

    def lines(self, number: int, task: "SpelTask") -> int:
        """Return Lof: how many whole lines have been received."""
        if self.waiting_bytes(number, task) <= 0:
            return 0
        port = self._port(number)
        return bytes(port.received).count(_terminator(port))

    def owner_number(self, number: int) -> int:
        """Return the number of the task that opened a port, 0 for none."""
        owner = self._port(number).owner
        return 0 if owner is None else owner.task_number

    def write(self, number: int, text: str, task: "SpelTask", *, ends: bool) -> None:
        """Send a text, with the end of a line if it says so.

        Raises:
            Refusal: The port is not open, not the task's, or there is no other end any more.
        """
        port = self._of(number, task)
        data = text.encode(_ENCODING, errors="replace") + (_terminator(port) if ends else b"")
        self.write_bytes(number, data, task)

    def write_bytes(self, number: int, data: bytes, task: "SpelTask") -> None:
        """Send bytes; see :meth:`write`."""
        port = self._of(number, task)
        if not port.connected or port.link is None:
            raise SpelRefusal(RefusalKind.PORT_BROKEN, f"Port {number} is not connected")
        try:
            port.link.settimeout(1.0)
            port.link.sendall(data)
            port.link.setblocking(False)
        except OSError as error:
            self._lose(port)
            raise SpelRefusal(RefusalKind.PORT_BROKEN, f"Port {number}: {error}") from error

    def line(self, number: int, task: "SpelTask") -> str | None:
        """Take a whole line, without its end; ``None`` while there is none.

        Raises:
            Refusal: The other end is gone, or the line is longer than a string can be.
        """
        port = self._of(number, task)
        end = _terminator(port)
        text, found, rest = bytes(port.received).partition(end)
        if not found:
            self._need_link(number, port)
            return None
        port.received[:] = rest
        if len(text) > LONGEST_STRING:
            raise SpelRefusal(RefusalKind.PORT_LINE_TOO_LONG, f"A line of {len(text)} bytes")
        return text.decode(_ENCODING)

    def bytes(self, number: int, count: int, task: "SpelTask") -> bytes | None:
        """Take some bytes; ``None`` while there are too few.

        Raises:
            Refusal: The other end is gone.
        """
        port = self._of(number, task)
        if len(port.received) < count:
            self._need_link(number, port)
            return None
        taken = bytes(port.received[:count])
        del port.received[:count]
        return taken

    def foreign(self, number: int, task: "SpelTask") -> bool:
        """Return whether a port belongs to another task."""
        return self._port(number).owner is not task

    def require_binary(self, number: int, task: "SpelTask") -> None:
        """Accept bytes: every port carries them."""

    def _of(self, number: int, task: "SpelTask") -> _Port:
        port = self._port(number)
        if not port.is_open:
            raise SpelRefusal(RefusalKind.PORT_NOT_OPEN, f"Port {number} is not open")
        if port.owner is not task:
            raise SpelRefusal(RefusalKind.PORT_OF_OTHER_TASK, f"Port {number}: another task")
        self._attend(number, port)
        return port

    def _need_link(self, number: int, port: _Port) -> None:
        if not port.connected:
            raise SpelRefusal(RefusalKind.PORT_BROKEN, f"Port {number} is not connected")

    def _port(self, number: int) -> _Port:
        if number not in self._ports:
            raise out_of_range(f"There is no port {number}")
        return self._ports[number]

    def _address(self, number: int, port: _Port) -> Address:
        if number in self.addresses:
            return self.addresses[number]
        if port.settings is None:
            raise SpelRefusal(RefusalKind.PORT_UNSET, f"Port {number} was never set")
        host, tcp_port = port.settings.address
        host = "127.0.0.1" if host in ("", "localhost", "0.0.0.0") else host
        try:
            inside = ipaddress.ip_address(host).is_loopback
        except ValueError:
            inside = False
        if not inside or not 0 < tcp_port <= 0xFFFF:
            raise SpelRefusal(
                RefusalKind.PORT_ADDRESS, f"Port {number}: only this machine is reached"
            )
        return host, tcp_port

    def _attend(self, number: int, port: _Port) -> None:
        """Accept, connect and receive what has come."""
        if port.link is None and port.listener is not None:
            try:
                port.link, _ = port.listener.accept()
            except OSError:
                return
            port.link.setblocking(False)
            port.connected = True
        if port.link is not None and not port.connected:
            self._connect(number, port)
        if port.link is None or not port.connected or len(port.received) >= _MOST_BYTES:
            return
        try:
            data = port.link.recv(_MOST_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            port.received += data
        else:
            self._lose(port)

    def _connect(self, number: int, port: _Port) -> None:
        """Check whether the other end has answered; try again if it was not there."""
        if port.link is None or isinstance(port.link, SerialLink):
            return
        error = port.link.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        try:
            port.link.getpeername()
        except OSError:
            if error:
                port.link.close()
                port.link = self.dial(self._address(number, port))
            return
        port.connected = True

    def _lose(self, port: _Port) -> None:
        """Note that the other end is gone; a server accepts the next one."""
        port.connected = False
        if port.listener is not None and port.link is not None:
            port.link.close()
            port.link = None


def _terminator(port: _Port) -> bytes:
    return b"\r\n" if port.settings is None else port.settings.terminator
