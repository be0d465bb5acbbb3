"""A Modbus server in a thread of its own. The only simulator module that imports pymodbus.

pymodbus renames what it offers in minor releases, and its action hook fires for read-backs
too (docs/decisions/0012-modbus-and-canopen-libraries.md); all of that is dealt with here. Nothing
is kept in its own registers.
"""

import asyncio
import logging
import socket
import threading
from collections.abc import Callable, Coroutine
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.pdu import ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.plc_registers import PlcRegisters
from robolink_simulators.hosting.streams.tcp_host import NO_TIME
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.image import REGISTERS, Bank

# It writes to standard error when nobody listens; clients are told by their answers.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

_READS: Final = {1: Bank.HOLDING, 2: Bank.INPUT, 3: Bank.HOLDING, 4: Bank.INPUT}
_COIL_FUNCTIONS: Final = frozenset({1, 2, 5, 15})
_WORD_BITS: Final = 16
_ALL_UNITS: Final = 0
_SPLIT_S: Final = 0.01
_SETTLING_S: Final = 0.02
"""A connection made just now has to be accepted before it can be closed."""

Server = ModbusTcpServer | ModbusSerialServer


@dataclass(frozen=True, slots=True)
class SerialLine:
    """A serial line to serve.

    Attributes:
        path: The device.
        unit: The only unit that answers.
    """

    path: str
    unit: int


def _reason(place: tuple[str, int] | SerialLine, told: RuntimeError) -> OSError | OverflowError:
    """Return why nothing can listen there: the server knew, and keeps it to itself."""
    try:
        if not isinstance(place, SerialLine):
            family = socket.AF_INET6 if ":" in place[0] else socket.AF_INET
            with socket.socket(family) as another:
                another.bind(place)
    except (OSError, OverflowError) as reason:
        return reason
    return OSError(str(told).rstrip("."))


class ModbusServerThread:
    """Serves registers until it is closed.

    Args:
        registers: What is served.
        clock: The simulated time, in which answers are delayed.
        place: Host and port to listen on, or a serial port.

    Raises:
        OSError, OverflowError: It cannot listen there.
    """

    def __init__(
        self, registers: PlcRegisters, clock: ScaledClock, place: tuple[str, int] | SerialLine
    ) -> None:
        self._registers = registers
        self._clock = clock
        # A device on a serial line answers one request after the other. The server here would
        # answer the next one while a late answer waits, and the late one to whoever asks then.
        self._turn = asyncio.Lock() if isinstance(place, SerialLine) else nullcontext()
        self._has_connections = not isinstance(place, SerialLine)
        self._cut_at = registers.ends
        self._met: tuple[PlcFault, ...] = ()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="modbus host", daemon=True)
        self._thread.start()
        try:
            self._server = self._wait_for(self._started(place))
        except BaseException:
            self._end_thread()
            raise

    @property
    def port(self) -> int:
        """The TCP port."""
        transport: Any = self._server.transport
        number: int = transport.sockets[0].getsockname()[1]
        return number

    @property
    def ends(self) -> tuple[int, int]:
        """What counts the ends of all connections."""
        return self._registers.ends

    def cut(self) -> None:
        """Close every connection; any thread may call it."""
        self._loop.call_soon_threadsafe(self._cut)

    def close(self) -> None:
        """Stop serving. Idempotent."""
        if not self._loop.is_closed():
            self._wait_for(self._stopped())
            self._end_thread()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()

    def _end_thread(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _wait_for(self, work: Coroutine[Any, Any, Any]) -> Any:  # noqa: ANN401 - whatever it gives
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _started(self, place: tuple[str, int] | SerialLine) -> Server:
        # Unit 0 stands for all; to be silent a server must know that units may be missing.
        habits: dict[str, Any] = {"ignore_missing_devices": True}
        server: Server
        if isinstance(place, SerialLine):
            habits["trace_pdu"] = _only_for(place.unit)
            server = ModbusSerialServer(self._device(), port=place.path, **habits)
        else:
            server = ModbusTcpServer(self._device(), address=place, **habits)
        self._watch_connections(server)
        try:
            await server.serve_forever(background=True)
        except RuntimeError as error:
            raise _reason(place, error) from None
        return server

    async def _stopped(self) -> None:
        await asyncio.sleep(_SETTLING_S)
        await self._server.shutdown()
        await asyncio.sleep(_SETTLING_S)

    def _device(self) -> SimDevice:
        words = [SimData(0, count=REGISTERS, values=0, datatype=DataType.REGISTERS)]
        # By the word: each value is looked at several times, and there are 65,536 bits.
        bits = [SimData(0, values=[0] * REGISTERS, datatype=DataType.BITS)]
        banks = (bits, bits, words, words)
        return SimDevice(id=_ALL_UNITS, simdata=banks, action=self._act)

    async def _act(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Do a request on our registers; ``registers`` are those that are answered with."""
        async with self._turn:
            return await self._carried_out(function, start, address, count, registers, values)

    async def _carried_out(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        self._clock.exchanged()
        coils = function in _COIL_FUNCTIONS
        first = address // _WORD_BITS if coils else address
        if values is None and function not in _READS:
            # A read-back, or the read half of a combined function.
            words = self._registers.peek(Bank.HOLDING, first, count)
        elif values is None:
            served = self._in_time(self._registers.read, _READS[function], first, count)
            words = list(served.words)
            await self._let_go(served)
            if (refusal := served.meets(PlcFaultAction.MODBUS_EXCEPTION)) is not None:
                return ExcCodes(refusal.code)
        else:
            if coils:
                bits = [bool(bit) for bit in values]
                served = self._in_time(self._registers.switch, address, bits)
            else:
                asked = [int(word) for word in values]
                served = self._in_time(self._registers.write, address, asked)
            await self._let_go(served)
            refusal = served.meets(PlcFaultAction.MODBUS_EXCEPTION)
            return None if refusal is None else ExcCodes(refusal.code)
        registers[first - start : first - start + count] = words
        return None

    def _in_time(self, serve: Callable[..., ServedAccess], *asked: object) -> ServedAccess:
        """Carry a request out, unless its connection has ended and is about to be closed.

        The controller that it was meant for is gone; another one in its place must not answer.
        """
        with self._registers.lock:
            if self._has_connections and self._cut_at != self._registers.ends:
                return ServedAccess(answered=False, cut=True)
            return serve(*asked)

    async def _let_go(self, served: ServedAccess) -> None:
        if served.cut:
            self._cut()
        if served.delay_s:
            await asyncio.sleep(self._real_seconds(served.delay_s))
        if served.meets(PlcFaultAction.RESET):
            self._each_transport(_reset)
        elif served.meets(PlcFaultAction.HALF_OPEN):
            self._each_transport(lambda transport: transport.pause_reading())
        elif served.answered:
            self._met = served.met  # the answer is packed and sent before anything else runs
            return
        raise NoSuchIdException

    def _real_seconds(self, simulated_s: float) -> float:
        at_ns = self._clock.now_ns() + round(simulated_s * NS_PER_S)
        return self._clock.real_seconds(at_ns)

    def _watch_connections(self, server: Server) -> None:
        """Have the frames of each connection pass through here before they leave."""
        usual: Any = server.callback_new_connection

        def accepted() -> Any:  # noqa: ANN401 - a handler, for which pymodbus has no public name
            handler: Any = usual()
            handler.trace_packet = partial(self._sent, handler)
            return handler

        server.callback_new_connection = accepted  # type: ignore[method-assign]

    def _sent(self, handler: Any, sending: bool, data: bytes) -> bytes:  # noqa: ANN401 - as above
        """Return what leaves at once instead of a frame."""
        if not sending or not self._met:
            return data
        met, self._met = self._met, ()
        for fault in met:
            middle = len(data) // 2 if fault.position is None else fault.position % len(data)
            match fault.action:
                case PlcFaultAction.TRUNCATE_REPLY:
                    data = data[:middle]
                case PlcFaultAction.DUPLICATE_REPLY:
                    data = data + data
                case PlcFaultAction.SPLIT_REPLY:
                    late_s = self._real_seconds(fault.seconds or _SPLIT_S)
                    self._loop.call_later(late_s, handler.transport.write, data[middle:])
                    data = data[:middle]
        return data

    def _cut(self) -> None:
        self._cut_at = self._registers.ends
        for connection in tuple(self._server.active_connections.values()):
            connection.close()

    def _each_transport(self, act: Callable[[Any], None]) -> None:
        for connection in tuple(self._server.active_connections.values()):
            act(connection.transport)


def _reset(transport: Any) -> None:  # noqa: ANN401 - asyncio's, of any kind
    """End a connection by a reset: to linger for no time is to reset."""
    transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME)
    transport.abort()


def _only_for(unit: int) -> Callable[[bool, ModbusPDU], ModbusPDU | None]:
    def heard(sending: bool, pdu: ModbusPDU) -> ModbusPDU | None:
        return pdu if sending or pdu.dev_id == unit else None

    return heard
