"""A SoftMotion PLC in a virtual cell behind Modbus frames: on a network, or on a serial line."""

from collections.abc import Sequence
from typing import Final

from robolink.timing import Deadline
from robolink.transport import MailboxLink, parse_url
from robolink.transport.modbus.client import Exchange, ModbusClient
from robolink.transport.modbus.frames import RtuFraming, TcpFraming
from robolink.transport.modbus.mailbox import MailboxPlaces, ModbusMailboxLink
from robolink.transport.modbus.messages import Area
from robolink.transport.modbus.rtu import RtuExchange, RtuLine
from robolink.transport.modbus.tcp import TcpExchange
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.transport import LinePort
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Disturbance, Hindrance
from robolink_simulators.soak.plant.lines.bent_line import BentLine, BentTransport
from robolink_simulators.soak.plant.lines.mailbox_frames import MailboxFrames
from robolink_simulators.soak.plant.machine import WireTap
from robolink_simulators.soak.plant.softmotion import SoftMotionPlant

BAUD: Final = 38_400
CHARACTER_S: Final = 11 / BAUD

_UNIT: Final = 1
_TIMEOUT_S: Final = 3.0
_PLACES: Final = MailboxPlaces(command=0, response=0, slots=112, area=Area.INPUT)
RTU_LINE: Final = RtuLine(
    character_s=CHARACTER_S,
    silence_s=0.00175,
    quiet_s=0.02,
    echo=False,
    probe_area=Area.INPUT,
    probe_address=0,
)


class ModbusTcpPlant(SoftMotionPlant):
    """A PLC with its mailbox on Modbus TCP; made from what :class:`SoftMotionPlant` is."""

    baud = 0

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._device = MailboxFrames(self.simulator, clock, unit=_UNIT, baud=self.baud)

    def link(self) -> MailboxLink:
        """Open a connection of one's own."""
        transport = BentTransport(
            parse_url(self.address), self._device, self.clock, self.simulator.lock, durable=True
        )
        return self._mailbox(transport, TcpExchange(transport, self.address, TcpFraming()))

    def _mailbox(self, transport: BentTransport, exchange: Exchange) -> ModbusMailboxLink:
        client = ModbusClient(
            transport, exchange, identity=self.address, unit=_UNIT, timeout_s=_TIMEOUT_S
        )
        return ModbusMailboxLink(client, _PLACES, lambda _timeout_s: self._again())

    def _again(self) -> ModbusMailboxLink:
        link = self.link()
        assert isinstance(link, ModbusMailboxLink)  # noqa: S101 - for the type
        return link


class ModbusRtuPlant(ModbusTcpPlant):
    """A PLC with its mailbox on Modbus RTU; made from what :class:`SoftMotionPlant` is."""

    baud = BAUD

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._port = LinePort(self._device)
        self._line = BentLine()
        self._open: dict[int, MailboxLink] = {}

    def link(self) -> MailboxLink:
        """Open the port, and get in step with the unit."""
        transport = BentTransport(
            parse_url(self.address), self._port, self.clock, self.simulator.lock, durable=True
        )
        transport.line = self._line
        exchange = RtuExchange(transport, self.address, RTU_LINE, RtuFraming())
        try:
            exchange.get_in_step(_UNIT, Deadline.after(self.clock, _TIMEOUT_S))
        except BaseException:
            transport.close()
            raise
        return self._mailbox(transport, exchange)

    def tapped(self, link: MailboxLink, process: VirtualProcess) -> MailboxLink:
        """See :meth:`SoftMotionPlant.tapped`."""
        self._open[process.number] = link
        return super().tapped(link, process)

    def announce(self, text: str, words: Sequence[int] = ()) -> None:
        """See :meth:`SoftMotionPlant.announce`; the line is told what is asked, too."""
        super().announce(text, words)
        self._line.announce(text)

    def hang_up(self, process: VirtualProcess) -> None:
        """The system closes the port of a process that died."""
        link = self._open.pop(process.number, None)
        if link is not None:
            link.close()

    def arm(self, disturbance: Disturbance) -> None:
        """See :meth:`SoftMotionPlant.arm`; a line bends bytes, too."""
        if disturbance.kind is Hindrance.LINE:
            self._line.acts.plan(disturbance)
        else:
            super().arm(disturbance)

    def disarm(self) -> int:
        """See :meth:`SoftMotionPlant.disarm`."""
        return super().disarm() + self._line.acts.clear()

    @property
    def bent(self) -> bool:
        """See ``PlantMachine.bent``; the line may have bent something, too."""
        return super().bent or bool(self._line.acts.met)
