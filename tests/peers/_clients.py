"""Third-party clients, and ours, with the same three tasks: two values to read, and one write."""

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import count
from typing import Any, Final, Protocol

import canopen
import minimalmodbus
from pymodbus.client import ModbusTcpClient
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.model import Controller, ToolOffset
from tests.peers._can_proxy import CanProxy
from tests.peers._faulty_proxy import Begins, Fault, SerialProxy, TcpProxy

TIMEOUT_S: Final = 0.5
"""Given to every client; all other settings are the defaults."""

_NODE: Final = 5
_buses = count()


class Wire(Protocol):
    """A proxy of any kind."""

    @property
    def frames(self) -> list[Any]:
        """The client's frames since the fault was chosen."""

    def arm(self, fault: Fault, begins: Begins = ...) -> None:
        """Choose the fault, and the request at which it begins."""


class Peer(Protocol):
    """One client on one proxy.

    Attributes:
        wire: Its proxy.
        oldest: The bytes of an old answer that waits for it.
    """

    wire: Wire

    def open(self, *, stale: bool) -> None:
        """Connect; with an old answer waiting if ``stale``."""

    def read(self, which: int) -> object:
        """Read value 1 or 2, which differ."""

    def write(self) -> None:
        """Write once."""

    def is_write(self, frame: bytes) -> bool:
        """Whether a frame carries that write."""

    def close(self) -> None:
        """Hang up."""


class NaiveSocket:
    """A client as in many public scripts: send, recv(1023), split at the comma."""

    stale = b'#Execute,"  9.000\r\n"\r\n'

    def __init__(self, stack: ExitStack) -> None:
        simulator = EpsonSimulator(seed=1)
        self.wire = _tcp(stack, stack.enter_context(serve_tcp(simulator)).url)

    def open(self, *, stale: bool) -> None:
        self.wire.prelude = self.stale if stale else b""
        self._socket = socket.create_connection(("127.0.0.1", self.wire.port))
        self._socket.settimeout(TIMEOUT_S)
        self._ask("$Login,")

    def read(self, which: int) -> object:
        return self._ask(f'$Execute,"Print {("Tool", "Motor", "Robot * 7")[which]}"')

    def write(self) -> None:
        said = self._ask('$Execute,"TLSet 3, XY(1, 2, 3, 0)"')
        if not said.startswith("#"):
            raise ValueError(said)

    def is_write(self, frame: bytes) -> bool:
        return b"TLSet 3" in frame

    def close(self) -> None:
        self._socket.close()

    def _ask(self, command: str) -> str:
        self._socket.send(command.encode() + b"\r\n")
        return self._socket.recv(1023).decode()


class Pymodbus:
    """pymodbus 3 with its defaults except the time-out."""

    stale = bytes([0, 1, 0, 0, 0, 5, 255, 4, 2, 0, 99])

    def __init__(self, stack: ExitStack) -> None:
        host = stack.enter_context(serve_modbus_tcp(SoftMotionSimulator()))
        self.wire = _tcp(stack, host.url)

    def open(self, *, stale: bool) -> None:
        self.wire.prelude = self.stale if stale else b""
        self._client = ModbusTcpClient("127.0.0.1", port=self.wire.port, timeout=TIMEOUT_S)
        assert self._client.connect()

    def read(self, which: int) -> object:
        found = self._client.read_input_registers((0, 88)[which - 1], count=1, device_id=255)
        if found.isError():
            raise ValueError(str(found))
        return found.registers

    def write(self) -> None:
        done = self._client.write_registers(2000, [1] * 64, device_id=255)
        if done.isError():
            raise ValueError(str(done))

    def is_write(self, frame: bytes) -> bool:
        return frame[7] == 16

    def close(self) -> None:
        self._client.close()


class Minimalmodbus:
    """minimalmodbus 2 on a serial line, with its defaults except the time-out."""

    stale = bytes([1, 4, 2, 0, 99, 0xF8, 0xDB])

    def __init__(self, stack: ExitStack) -> None:
        host = stack.enter_context(serve_modbus_rtu(SoftMotionSimulator()))
        path = "/" + host.url.partition(":///")[2].partition("?")[0]
        self.wire = stack.enter_context(SerialProxy(path))

    def open(self, *, stale: bool) -> None:
        self._instrument = minimalmodbus.Instrument(self.wire.port, 1)
        self._instrument.serial.timeout = TIMEOUT_S
        if stale:
            self.wire.push(self.stale)

    def read(self, which: int) -> object:
        return self._instrument.read_register((0, 88)[which - 1], functioncode=4)

    def write(self) -> None:
        self._instrument.write_registers(2000, [1] * 64)

    def is_write(self, frame: bytes) -> bool:
        return frame[1] == 16

    def close(self) -> None:
        self._instrument.serial.close()


class Canopen:
    """canopen 2 with its defaults: one attempt, 0.3 s."""

    stale = bytes([0x4B, 0x02, 0x21, 0x01, 99, 0, 0, 0])

    def __init__(self, stack: ExitStack) -> None:
        self.wire, self._near = _can(stack, SoftMotionSimulator())

    def open(self, *, stale: bool) -> None:
        self._network = canopen.Network()
        self._network.connect(interface="virtual", channel=self._near)
        dictionary = "companions/codesys/robolink_mailbox.eds"
        self._node = self._network.add_node(canopen.RemoteNode(_NODE, dictionary))
        if stale:
            self.wire.put(self.stale)

    def read(self, which: int) -> object:
        return self._node.sdo.upload(0x2102, which)

    def write(self) -> None:
        self._node.sdo.download(0x2102, 5, b"\1\0")

    def is_write(self, frame: bytes) -> bool:
        return frame[0] >> 5 == 1

    def close(self) -> None:
        self._network.disconnect()


class Ours:
    """robolink's own driver over one of the links."""

    def __init__(self, stack: ExitStack, link: str) -> None:
        self._link, self._stack = link, stack
        self._controller: Controller | None = None
        if link == "epson+tcp":
            host = stack.enter_context(serve_tcp(EpsonSimulator(seed=1)))
            self.stale = NaiveSocket.stale
            self.wire: Any = _tcp(stack, host.url)
            self.url = f"epson+tcp://127.0.0.1:{self.wire.port}"
            return
        plc = SoftMotionSimulator()
        if link == "modbus-tcp":
            self.wire = _tcp(stack, stack.enter_context(serve_modbus_tcp(plc)).url)
            self.stale = Pymodbus.stale
            self.url = f"softmotion+modbus-tcp://127.0.0.1:{self.wire.port}"
        elif link == "modbus-rtu":
            path, options = stack.enter_context(serve_modbus_rtu(plc)).url.split("?")
            self.wire = stack.enter_context(SerialProxy("/" + path.partition(":///")[2]))
            self.stale = Minimalmodbus.stale
            self.url = f"softmotion+modbus-rtu://{self.wire.port}?{options}"
        else:
            self.wire, near = _can(stack, plc)
            self.stale = Canopen.stale
            self.url = f"softmotion+can://{near}?interface=virtual&node={_NODE}"

    def open(self, *, stale: bool) -> None:
        if stale and self._link in ("modbus-rtu", "can"):
            self.wire.put(self.stale) if self._link == "can" else self.wire.push(self.stale)
        elif stale:
            self.wire.prelude = self.stale
        self._controller = robolink.connect(self.url, timeout_s=TIMEOUT_S)
        # Two writes, so that it owns the mailbox and knows the stored tool.
        tools = self._controller.tools
        tools.write(3, ToolOffset(7, 7, 7), expected=tools.read(3))
        tools.write(3, ToolOffset(5, 5, 5), expected=ToolOffset(7, 7, 7))

    def read(self, which: int) -> object:
        assert self._controller is not None
        return self._controller.tools.read((1, 3)[which - 1])

    def write(self) -> None:
        assert self._controller is not None
        self._controller.tools.write(3, ToolOffset(1, 2, 3), expected=ToolOffset(5, 5, 5))

    def is_write(self, frame: bytes) -> bool:
        if self._link == "epson+tcp":
            return b"TLSet 3, XY" in frame
        if self._link == "can":
            return frame[0] >> 5 == 1 and frame[1:4] == b"\x00\x21\x00"
        function = frame[7] if self._link == "modbus-tcp" else frame[1]
        return function == 16 and len(frame) > 64

    def close(self) -> None:
        if self._controller is not None:
            self._controller.close()


PEERS: Final[dict[str, Callable[[ExitStack], Any]]] = {
    "a naive socket (EPSON text)": NaiveSocket,
    "pymodbus (TCP)": Pymodbus,
    "minimalmodbus (RTU)": Minimalmodbus,
    "canopen (CAN)": Canopen,
    "robolink, EPSON text": lambda stack: Ours(stack, "epson+tcp"),
    "robolink, Modbus TCP": lambda stack: Ours(stack, "modbus-tcp"),
    "robolink, Modbus RTU": lambda stack: Ours(stack, "modbus-rtu"),
    "robolink, CANopen": lambda stack: Ours(stack, "can"),
}


@contextmanager
def peer(name: str) -> Iterator[Any]:
    """Serve a simulator behind a proxy, with one client of that name before it."""
    with ExitStack() as stack:
        client = PEERS[name](stack)
        try:
            yield client
        finally:
            client.close()


def _tcp(stack: ExitStack, url: str) -> TcpProxy:
    port = int(url.partition("://")[2].partition("?")[0].rpartition(":")[2])
    return stack.enter_context(TcpProxy(port))


def _can(stack: ExitStack, plc: SoftMotionSimulator) -> tuple[CanProxy, str]:
    number = next(_buses)
    near, far = f"peers-near-{number}", f"peers-far-{number}"
    stack.enter_context(serve_canopen(plc, CanPlace("virtual", far, node=_NODE)))
    return stack.enter_context(CanProxy(near, far, _NODE)), near
