"""An EPSON controller with Remote RS232 in a virtual cell, and the line that leads to it."""

from robolink.controllers.epson.line import EpsonLine
from robolink.controllers.epson.serial_opening import turn_on
from robolink.protocols import Role
from robolink.protocols.epson_binary import EpsonBinaryCodec
from robolink.protocols.epson_text import BadRequest, Request
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.options import serial_dialect
from robolink_simulators.epson.remote.wire_text import shown_request
from robolink_simulators.hosting.in_process.transport import LinePort
from robolink_simulators.hosting.streams.epson import SerialFace
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Disturbance, Hindrance
from robolink_simulators.soak.plant.epson import EpsonPlant, TappedTransport
from robolink_simulators.soak.plant.lines.bent_line import BentLine
from robolink_simulators.soak.plant.machine import WireTap


class EpsonSerialPlant(EpsonPlant):
    """An EPSON SCARA on Remote RS232; made from what :class:`EpsonPlant` is made from."""

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._port = LinePort(SerialFace(self.simulator))
        self._line = BentLine()
        self._dialect = serial_dialect(self.simulator.options)

    def line_of(self, process: VirtualProcess) -> EpsonLine:
        """Open the port and turn the line on."""
        link = TappedLine(self.simulator, self._port, self.clock, process, self.tap, self.address)
        link.line = self._line
        self._links[process.number] = link
        try:
            turn_on(link)
        except BaseException:
            link.close()
            raise
        codec = EpsonBinaryCodec(Role.HOST, self._dialect)
        return EpsonLine(link, codec, outlives_sessions=True)

    def arm(self, disturbance: Disturbance) -> None:
        """See :meth:`EpsonPlant.arm`; a line bends bytes, too."""
        if disturbance.kind is Hindrance.LINE:
            self._line.acts.plan(disturbance)
        else:
            super().arm(disturbance)

    def disarm(self) -> int:
        """See :meth:`EpsonPlant.disarm`."""
        return super().disarm() + self._line.acts.clear()

    @property
    def bent(self) -> bool:
        """See ``PlantMachine.bent``; the line may have bent something, too."""
        return super().bent or bool(self._line.acts.met)


class TappedLine(TappedTransport):
    """A process's time at the line, on which the adversary reads the frames."""

    ends_with_silence = False
    """A line outlives every session: it is silenced and turned on anew, in the same process."""

    def told(self, data: bytes, *, secret: bool) -> str:
        """Return a request in words, as the same one is written on a network."""
        if secret:
            return "$Login"
        codec = EpsonBinaryCodec(Role.DEVICE)
        codec.receive_data(data)
        event = codec.next_event()
        return shown_request(event) if isinstance(event, (Request, BadRequest)) else "EOT"
