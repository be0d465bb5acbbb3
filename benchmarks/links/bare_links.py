"""The least that a tool write needs of a link: pymodbus, or canopen, and nothing decoded."""

import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from queue import SimpleQueue
from typing import Any, Final, Protocol
from urllib.parse import parse_qs, urlsplit

import canopen
from pymodbus.client import ModbusTcpClient

from robolink.protocols.mailbox import RESPONSE_WORDS, SLOT_WORDS, Words, slot_start

SLOT: Final = 5
"""Number of the slot that is written."""

ACK: Final = 1
"""Index, in the response and its head, of the last accepted sequence number."""

_HEAD_WORDS: Final = 10
_TPDO1: Final = 0x180
_PATIENCE_S: Final = 5.0


class BareClient(Protocol):
    """What the floor does on a link."""

    def write_command(self, words: Words) -> None:
        """Write the command block."""

    def read_response(self) -> Words:
        """Read the response block."""

    def read_slot(self) -> Words:
        """Read the slot."""

    def await_head(self, sequence: int) -> None:
        """Return when the head of the response acknowledges a command."""


Bare = Callable[[str], AbstractContextManager[BareClient]]


class _BareModbus:
    def __init__(self, client: ModbusTcpClient) -> None:
        self._client = client

    def write_command(self, words: Words) -> None:
        self._client.write_registers(0, list(words))

    def read_response(self) -> Words:
        return tuple(self._client.read_input_registers(0, count=RESPONSE_WORDS).registers)

    def read_slot(self) -> Words:
        first = slot_start(SLOT)
        return tuple(self._client.read_input_registers(first, count=SLOT_WORDS).registers)

    def await_head(self, sequence: int) -> None:
        while self._client.read_input_registers(0, count=_HEAD_WORDS).registers[ACK] != sequence:
            pass


@contextmanager
def bare_modbus(url: str) -> Iterator[BareClient]:
    """Connect to a ``softmotion+modbus-tcp`` URL with pymodbus."""
    parts = urlsplit(url)
    with ModbusTcpClient(parts.hostname or "", port=parts.port or 0, retries=0) as client:
        yield _BareModbus(client)


class _BareCan:
    def __init__(self, node: Any) -> None:  # noqa: ANN401 - canopen declares no types
        self._sdo = node.sdo
        self._heads: SimpleQueue[int] = SimpleQueue()
        node.network.subscribe(_TPDO1 + node.id, self._take_head)
        node.nmt.state = "OPERATIONAL"

    def write_command(self, words: Words) -> None:
        self._sdo.download(0x2100, 0, struct.pack(f"<{len(words)}H", *words))

    def read_response(self) -> Words:
        self._sdo.download(0x2102, 5, b"\1\0")
        return self._words(0x2101, 0)

    def read_slot(self) -> Words:
        return self._words(0x2200, SLOT)

    def await_head(self, sequence: int) -> None:
        while self._heads.get(timeout=_PATIENCE_S) != sequence:
            pass

    def _take_head(self, _identifier: int, data: bytearray, _timestamp: float) -> None:
        self._heads.put(int.from_bytes(data[:2], "little"))

    def _words(self, index: int, subindex: int) -> Words:
        data = self._sdo.upload(index, subindex)
        return struct.unpack(f"<{len(data) // 2}H", data)


@contextmanager
def bare_can(url: str) -> Iterator[BareClient]:
    """Join the bus of a ``softmotion+can`` URL with canopen."""
    parts = urlsplit(url)
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    network.connect(
        interface="udp_multicast", channel=parts.hostname, port=parts.port, hop_limit=0, fd=False
    )
    try:
        node = int(parse_qs(parts.query)["node"][0])
        objects: Any = canopen.ObjectDictionary  # it declares no types
        yield _BareCan(network.add_node(node, objects()))
    finally:
        network.disconnect()


def free_port() -> int:
    """Return a UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
