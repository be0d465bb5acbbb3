"""One tool write through a PLC's mailbox against the bare calls that it cannot do without.

Those are: the slot and the response block (may it be written?), the response again just before
the command block leaves, the head until it acknowledges, the response (how did it end?), and
the slot (what is there now?). The floor makes them with pymodbus, or with canopen's SDO client
and its subscription of TPDO1, and decodes nothing; its command blocks are encoded beforehand.
The driver keeps its journal in memory, so that only the link is compared. As in
:mod:`benchmarks.exchange` the simulator has a process, and where there are two a CPU, of its
own; its program looks at the mailbox every 4 ms, as a PLC does, and both sides wait for that.

Each write begins at another point of that cycle, as a lone write does. Back to back both sides
fall into step with it: a write then takes one cycle or two, and where the driver's comes near
the end of one the ratio is 1.05 in one run and 1.55 in the next.
"""

import os
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from itertools import count
from queue import SimpleQueue
from statistics import median
from time import perf_counter_ns
from typing import Any, Final, Protocol
from urllib.parse import parse_qs, urlsplit

import canopen
from pymodbus.client import ModbusTcpClient

import robolink
from benchmarks.exchange import served_simulator
from benchmarks.table import Figure
from robolink.journal import memory_journal
from robolink.model import ToolOffset
from robolink.protocols.mailbox import (
    RESPONSE_WORDS,
    SLOT_WORDS,
    Command,
    Opcode,
    Words,
    encode_command,
    slot_start,
)

ROUNDS: Final = 7
WRITES: Final = 20
WARM_UP: Final = 4
GOAL: Final = 1.3

_SLOT: Final = 5
_OWNER: Final = 0xBE7C
_ACK, _EPOCH, _HEAD_WORDS = 1, 14, 10
_TPDO1: Final = 0x180
_PATIENCE_S: Final = 5.0
_CYCLE_NS: Final = 4_000_000
"""Period of the simulated mailbox program."""

_OFFSETS: Final = (ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.125, -3.25, -20.0))
_POSES: Final = ((12.0, -3.5, -20.0, 0.0, 0.0, 0.0), (12.125, -3.25, -20.0, 0.0, 0.0, 0.0))
_GROUP: Final = "239.74.163.8"


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


def measure_mailbox() -> Iterator[Figure]:
    """Yield the figures of a tool write over Modbus TCP and over CAN."""
    cpus = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    simulator_cpu = cpus[1] if len(cpus) > 1 else None
    can = f"udp_multicast:{_GROUP}:{_free_port()}"
    try:
        if simulator_cpu is not None:
            os.sched_setaffinity(0, {cpus[0]})
        serving = ("softmotion", "--modbus-tcp", "127.0.0.1:0")
        yield from _compare("Modbus TCP", "pymodbus", serving, _bare_modbus, simulator_cpu)
        yield from _compare(
            "CAN", "canopen", ("softmotion", "--can", can), _bare_can, simulator_cpu
        )
    finally:
        if simulator_cpu is not None:
            os.sched_setaffinity(0, set(cpus))


def _compare(
    link: str, library: str, serving: tuple[str, ...], bare: Bare, simulator_cpu: int | None
) -> Iterator[Figure]:
    with served_simulator(simulator_cpu, serving) as url:
        rounds = [(_floor_round(url, bare), _driver_round(url)) for _ in range(ROUNDS)]
    floor, driver = (median(column) for column in zip(*rounds, strict=True))
    yield Figure(f"mailbox tool write over {link}, bare {library}", f"{floor:.0f} us")
    yield Figure(
        f"mailbox tool write over {link}, robolink (journal in memory)",
        f"{driver:.0f} us",
        median(ours / least for least, ours in rounds),
        GOAL,
    )


def _driver_round(url: str) -> float:
    with robolink.connect(url, outcomes=memory_journal(url).log(url)) as controller:
        stored = controller.tools.read(_SLOT)

        def write(number: int) -> None:
            nonlocal stored
            offset = _OFFSETS[number % 2]
            stored = controller.tools.write(_SLOT, offset, expected=stored).read_back

        return _microseconds(write)


def _floor_round(url: str, bare: Bare) -> float:
    with bare(url) as client:
        sequence = count(client.read_response()[_ACK] % 0xFFFF + 1)

        def carry_out(words: Words) -> Words:
            client.write_command(words)
            client.await_head(words[0])
            return client.read_response()

        def owned(taken: int, epoch: int = 0) -> Words:
            operands = (taken, 0, 0, 0)
            command = Command(next(sequence), Opcode.OWNERSHIP, operands=operands)
            return carry_out(_encoded(command, epoch))

        epoch = owned(1)[_EPOCH]
        blocks = [_write_block(next(sequence), number, epoch) for number in range(WARM_UP + WRITES)]

        def write(number: int) -> None:
            client.read_slot()
            client.read_response()
            client.read_response()
            carry_out(blocks[number])
            client.read_slot()

        try:
            return _microseconds(write)
        finally:
            owned(0, epoch)


def _write_block(sequence: int, number: int, epoch: int) -> Words:
    command = Command(
        sequence,
        Opcode.WRITE_TOOL,
        operands=(_SLOT, 0, 0, 0),
        pose=_POSES[number % 2],
        name="bare",
    )
    return _encoded(command, epoch)


def _encoded(command: Command, epoch: int) -> Words:
    return encode_command(replace(command, owner=_OWNER, epoch=epoch))


def _microseconds(write: Callable[[int], None]) -> float:
    """Return the mean time of a write, in microseconds; each begins elsewhere in the cycle."""
    for number in range(WARM_UP):
        write(number)
    passed_ns = 0
    for number in range(WRITES):
        begin_ns = perf_counter_ns() + _CYCLE_NS * number // WRITES
        while perf_counter_ns() < begin_ns:
            pass
        begin_ns = perf_counter_ns()
        write(WARM_UP + number)
        passed_ns += perf_counter_ns() - begin_ns
    return passed_ns / WRITES / 1000


class _BareModbus:
    def __init__(self, client: ModbusTcpClient) -> None:
        self._client = client

    def write_command(self, words: Words) -> None:
        self._client.write_registers(0, list(words))

    def read_response(self) -> Words:
        return tuple(self._client.read_input_registers(0, count=RESPONSE_WORDS).registers)

    def read_slot(self) -> Words:
        first = slot_start(_SLOT)
        return tuple(self._client.read_input_registers(first, count=SLOT_WORDS).registers)

    def await_head(self, sequence: int) -> None:
        while self._client.read_input_registers(0, count=_HEAD_WORDS).registers[_ACK] != sequence:
            pass


@contextmanager
def _bare_modbus(url: str) -> Iterator[_BareModbus]:
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
        return self._words(0x2200, _SLOT)

    def await_head(self, sequence: int) -> None:
        while self._heads.get(timeout=_PATIENCE_S) != sequence:
            pass

    def _take_head(self, _identifier: int, data: bytearray, _timestamp: float) -> None:
        self._heads.put(int.from_bytes(data[:2], "little"))

    def _words(self, index: int, subindex: int) -> Words:
        data = self._sdo.upload(index, subindex)
        return struct.unpack(f"<{len(data) // 2}H", data)


@contextmanager
def _bare_can(url: str) -> Iterator[_BareCan]:
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


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
