"""Far ends of a mailbox: real Modbus servers, a serial cable, a CANopen node.

They store words without interpreting them.
"""

import asyncio
import os
import select
import socket
import struct
import threading
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

NODE = 5
OPERATIONAL = 5
HOLDING, INPUT = 3, 4
RESPONSE_AT, SLOTS_AT = 0, 112


class FarEnd(Protocol):
    """The interface that the tests need from any far end."""

    url: str

    def put_response(self, words: Sequence[int]) -> None:
        """Set the response block."""

    def put_slot(self, slot: int, words: Sequence[int]) -> None:
        """Set a tool slot."""

    def put_device(self, low: int, high: int) -> None:
        """Set the PLC's device number, as two words."""

    def command(self) -> list[int]:
        """Return the command block as written."""

    def heartbeat(self) -> int:
        """Return the client's heartbeat word."""


class ModbusFarEnd:
    """A pymodbus server in its own thread."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.requests: list[tuple[int, int, int]] = []
        self._loop = asyncio.new_event_loop()
        self._server: Any = None
        self._thread = threading.Thread(target=self._loop.run_forever)

    def serve(self, make) -> None:
        """Start the thread, and in it the server that ``make`` returns."""
        self._thread.start()
        self._run(self._start(make))

    async def _start(self, make) -> None:
        self._server = make()
        await self._server.serve_forever(background=True)

    async def _end(self) -> None:
        await asyncio.sleep(0.02)  # a connection just made must be accepted before it can be closed
        await self._server.shutdown()
        await asyncio.sleep(0.02)

    @property
    def port(self) -> int:
        """The TCP port."""
        port: int = self._server.transport.sockets[0].getsockname()[1]
        return port

    def note(self, sending, pdu):
        """Record function, address and count of each request."""
        if not sending:
            self.requests.append((pdu.function_code, pdu.address, pdu.count))
        return pdu

    def put_response(self, words):
        self._put(INPUT, RESPONSE_AT, words)
        self._put(HOLDING, 1000, words)

    def put_slot(self, slot, words):
        self._put(INPUT, SLOTS_AT + 36 * (slot - 1), words)

    def put_device(self, low, high):
        self._put(INPUT, SLOTS_AT + 36 * 15, (low, high, low ^ 0xFFFF, high ^ 0xFFFF))

    def command(self):
        return list(self._run(self._server.async_getValues(1, HOLDING, 0, 64)))

    def heartbeat(self):
        return self.command()[62]

    def _put(self, area, address, words):
        self._run(self._server.async_setValues(1, area, address, list(words)))

    def _run(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(5)

    def stop(self) -> None:
        """End the server and its thread."""
        self._run(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(5)
        self._loop.close()


def registers() -> SimDevice:
    """A device with four separate tables, unit 1."""
    words = [SimData(0, count=2000, values=0, datatype=DataType.REGISTERS)]
    bits = [SimData(0, values=[False] * 64, datatype=DataType.BITS)]
    return SimDevice(id=1, simdata=(bits, bits, words, words))


@contextmanager
def modbus_tcp() -> Iterator[ModbusFarEnd]:
    """Serve over TCP on loopback."""
    far_end = ModbusFarEnd("")
    far_end.serve(
        lambda: ModbusTcpServer(registers(), address=("127.0.0.1", 0), trace_pdu=far_end.note)
    )
    far_end.url = f"softmotion+modbus-tcp://127.0.0.1:{far_end.port}?unit=1"
    try:
        yield far_end
    finally:
        far_end.stop()


class SerialCable:
    """Two pseudo terminals joined by a thread; can be cut, and can echo what is sent."""

    def __init__(self) -> None:
        pairs = [os.openpty() for _ in range(2)]
        self.near, self.far = (os.ttyname(device) for _, device in pairs)
        self._ends = [controller for controller, _ in pairs]
        self._devices = [device for _, device in pairs]
        for _, device in pairs:
            tty.setraw(device)
        self.echo = False
        self.cut = False
        self._stop, self._stopped = os.pipe()
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def _carry(self) -> None:
        near, far = self._ends
        while True:
            ready, _, _ = select.select([near, far, self._stop], [], [])
            if self._stop in ready:
                return
            for end in ready:
                data = os.read(end, 4096)
                if self.cut:
                    continue
                if end == near and self.echo:
                    os.write(near, data)
                os.write(far if end == near else near, data)

    def close(self) -> None:
        """Unplug both ends."""
        os.write(self._stopped, b"x")
        self._thread.join(5)
        for descriptor in (*self._ends, *self._devices, self._stop, self._stopped):
            os.close(descriptor)


@contextmanager
def modbus_rtu(*, echo: bool = False) -> Iterator[tuple[ModbusFarEnd, SerialCable]]:
    """Serve at the far end of a serial cable."""
    cable = SerialCable()
    cable.echo = echo
    far_end = ModbusFarEnd(f"softmotion+modbus-rtu://{cable.near}?baud=115200&parity=none")
    far_end.serve(
        lambda: ModbusSerialServer(
            registers(),
            port=cable.far,
            baudrate=115200,
            trace_pdu=far_end.note,
        )
    )
    try:
        yield far_end, cable
    finally:
        far_end.stop()
        cable.close()


class CanopenFarEnd:
    """A CANopen node of the ``canopen`` package, which copies the response on request."""

    def __init__(self, url: str, interface: str, **bus: Any) -> None:
        self.url = f"{url}?interface={interface}&node={NODE}"
        self.network = canopen.Network()
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.connect(interface=interface, ignore_config=True, **bus)
        self.node = self.network.create_node(NODE, objects())
        self.node.add_write_callback(self._written)
        self._heard: list[int] = []
        self.network.subscribe(0x200 + NODE, self._beaten)
        self._response = bytes(224)
        self._put(0x2101, 0, bytes(224))
        # Our own thread, because stopping python-can's thread does not wait for its end.
        self._ending = threading.Event()
        self._living = threading.Thread(target=self._live)
        self._living.start()

    def _live(self):
        while not self._ending.wait(0.1):
            self.network.send_message(0x700 + NODE, bytes([OPERATIONAL]))

    def _written(self, *, index, subindex, od, data):
        if (index, subindex) == (0x2102, 5):
            self._put(0x2101, 0, self._response)

    def _beaten(self, identifier, data, timestamp):
        self._heard.append(int.from_bytes(data, "little"))

    def _put(self, index, subindex, data):
        self.node.data_store.setdefault(index, {})[subindex] = data

    def put_response(self, words):
        self._response = struct.pack("<112H", *words)
        head = struct.pack("<HBBHH", words[1], words[2], words[7], words[3], words[9])
        self.network.send_message(0x180 + NODE, head)

    def put_slot(self, slot, words):
        self._put(0x2200, slot, struct.pack("<36H", *words))

    def put_device(self, low, high):
        self._put(0x1018, 4, struct.pack("<2H", low, high))

    def command(self):
        return list(struct.unpack("<64H", self.node.data_store[0x2100][0]))

    def heartbeat(self):
        for _ in range(100):
            if self._heard:
                return self._heard[-1]
            threading.Event().wait(0.01)
        return None

    def stop(self) -> None:
        """Take the node off the bus."""
        if not self._ending.is_set():
            self._ending.set()
            self._living.join(5)
            self.network.disconnect()


def objects() -> canopen.ObjectDictionary:
    """The part of the mailbox's object dictionary that a link uses."""
    dictionary = canopen.ObjectDictionary()
    period = ODVariable("producer_heartbeat_time", 0x1017)
    period.data_type, period.default = datatypes.UNSIGNED16, 100
    dictionary.add_object(period)
    for index, access in ((0x2100, "rw"), (0x2101, "ro")):
        block = ODVariable(f"block_{index:x}", index)
        block.data_type, block.access_type = datatypes.DOMAIN, access
        dictionary.add_object(block)
    record = ODRecord("mailbox", 0x2102)
    snapshot = ODVariable("snapshot", 0x2102, 5)
    snapshot.data_type = datatypes.UNSIGNED16
    record.add_member(snapshot)
    dictionary.add_object(record)
    identity = ODRecord("identity", 0x1018)
    serial = ODVariable("serial number", 0x1018, 4)
    serial.data_type = datatypes.UNSIGNED32
    identity.add_member(serial)
    dictionary.add_object(identity)
    slots = ODArray("slots", 0x2200)
    for slot in range(1, 16):
        member = ODVariable(f"slot_{slot}", 0x2200, slot)
        member.data_type = datatypes.DOMAIN
        slots.add_member(member)
    dictionary.add_object(slots)
    return dictionary


@contextmanager
def canopen_node(url: str, interface: str, **bus: Any) -> Iterator[CanopenFarEnd]:
    """Put a node on a bus, with a heartbeat every 100 ms."""
    far_end = CanopenFarEnd(url, interface, **bus)
    try:
        yield far_end
    finally:
        far_end.stop()


def multicast_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def virtual_node(channel):
    with canopen_node(f"softmotion+can://{channel}", "virtual", channel=channel) as far_end:
        yield far_end


@contextmanager
def multicast_node():
    group, port = f"239.74.163.{os.getpid() % 200 + 20}", multicast_port()
    url = f"softmotion+can://{group}:{port}"
    with canopen_node(url, "udp_multicast", channel=group, port=port, hop_limit=0) as far_end:
        yield far_end
