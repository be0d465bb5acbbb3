"""An EPSON controller in a virtual cell, and its link."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.frames import Frame
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import serial_dialect
from robolink_simulators.epson.remote.link import shown_request
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.addresses import WireDevice
from robolink_simulators.hosting.in_process.transport import LinePort
from robolink_simulators.hosting.streams.serial_host import DeviceOnLine

from robolink.controllers import open_epson
from robolink.controllers.epson.line import EpsonLine, text_line
from robolink.controllers.epson.serial_opening import turn_on
from robolink.errors import TransportError
from robolink.model import Controller, OutcomeLog, Secret, ToolOffset
from robolink.protocols import Role
from robolink.protocols.epson_binary import EpsonBinaryCodec
from robolink.protocols.epson_text import BadRequest, Request
from robolink.timing import Deadline
from robolink.transport import parse_url
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import CountedActs, Disturbance, Hindrance
from tests.soak.adversary.plant.lines import BentLine, BentTransport
from tests.soak.adversary.plant.machine import (
    USUAL_TOOL,
    MachineState,
    PlantWithWorld,
    SentKind,
    SentRequest,
    WireTap,
)

PASSWORD: Final = "canary-7413-remote"
"""The controller's password, which must not appear anywhere."""

_MOVES: Final = re.compile(r'\$Execute,"(?:Move|Go|Jump3?|BGo|BMove|TGo|TMove|Arc3?) ')
_WRITES: Final = re.compile(r'\$Execute,"(?:TLSet (\d+), |TLClr (\d+))')
_SELECTS: Final = re.compile(r'\$Execute,"Tool (\d+)"')
_STOPS: Final = re.compile(r"\$(?:Abort|Stop)")
_SOME_ERROR: Final = 2000
GIVES_UP: Final = "GIVES_UP"
"""The controller gives up waiting for a movement: error 19, and the arm goes on."""

_EXECUTED: Final = re.compile(rb"[#!]Execute[^\r\n]*\r?\n")


class EpsonPlant(PlantWithWorld):
    """An EPSON SCARA on Remote Ethernet.

    Args:
        clock: The virtual time.
        tap: Receives all wire traffic.
        seed: Decides its world.
    """

    kind = "epson"
    address = "epson+sim://cell"
    password = PASSWORD
    models = "T6-602S,GX4-C351S"
    """The first is the cell's own; the other one never moves and is never selected."""

    world = WorldParameters()

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap)
        self._simulator = EpsonSimulator(
            self.models,
            seed=seed,
            password=Secret(PASSWORD),
            serial=f"SOAK{seed:06d}",
            world=self.world,
        )
        self._simulator.machine.tools.set(2, USUAL_TOOL)
        self._simulator.present_ns = clock.now_ns
        self._simulator.on_request = self._requested
        self._links: dict[int, TappedTransport] = {}
        self._moves = 0
        self._parameters = self._simulator.machine.parameters
        self.impatience = CountedActs()

    @property
    def simulator(self) -> EpsonSimulator:
        """The simulated controller."""
        return self._simulator

    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Log in."""
        line = self.line_of(process)
        return open_epson(line, outcomes=outcomes, password=Secret(PASSWORD))

    def line_of(self, process: VirtualProcess) -> EpsonLine:
        """Open the wire for a process."""
        link = TappedTransport(
            self._simulator, self._simulator, self.clock, process, self.tap, self.address
        )
        link.impatience = self.impatience
        self._links[process.number] = link
        return text_line(link)

    def openings(self, process: VirtualProcess) -> Mapping[str, Callable[..., object]]:
        """See ``PlantMachine.openings``."""

        def opened(_url: object, **_terms: object) -> EpsonLine:
            return self.line_of(process)

        # The order matters: a module that imports the other must not get its stand-in.
        package = "robolink.controllers.epson"
        return {f"{package}.verify.run.open_line": opened, f"{package}.line.open_line": opened}

    def hang_up(self, process: VirtualProcess) -> None:
        """Close the connection of a process that died."""
        link = self._links.pop(process.number, None)
        if link is not None:
            link.close()

    def state(self) -> MachineState:
        """Return its tools and the selected one."""
        machine = self._simulator.machine
        parameters = machine.parameters
        if parameters is not self._parameters:  # Motor On, Reset and the like make new ones
            self._parameters, self.settings_reset = parameters, True
        settings = (float(machine.power_high), *parameters.speed, *parameters.speed_s)
        tools, selected = machine.tools, machine.tools.selected
        return MachineState(dict(tools.defined()), selected, settings, machine.robot_number)

    def flange(self) -> Frame:
        """Return the commanded flange pose of the current robot."""
        self._simulator.advance(self.clock.now_ns())
        return frame_of(self._simulator.machine.arm.flange())

    def tip(self) -> Frame:
        """Return the commanded pose of the selected tool's tip."""
        self._simulator.advance(self.clock.now_ns())
        return frame_of(self._simulator.machine.robot.tip())

    def prepare(self, person: WorldParameters) -> None:
        """See ``PlantMachine.prepare``; power and speed are those of production."""
        super().prepare(person)
        machine = self._simulator.machine
        if not machine.motors_on and not self._simulator.condition.serious:
            machine.robot.switch_motors(True)
        machine.power_high = True
        machine.parameters.speed = (30, 40, 50)
        machine.parameters.speed_s = (220.0, 230.0, 240.0)

    @property
    def moving(self) -> bool:
        """Whether the arm moves."""
        return self._simulator.machine.arm.moving

    @property
    def movements(self) -> int:
        """The number of movement statements received, without repetitions by the wire."""
        return self._moves

    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the wire, or an act at the controller."""
        if disturbance.kind is Hindrance.PENDANT:
            self.acts.plan(disturbance)
            return
        if disturbance.what == GIVES_UP:
            self.impatience.plan(disturbance)
            return
        self._simulator.faults.add(
            Fault(
                FaultAction[disturbance.what],
                disturbance.at,
                disturbance.match,
                seconds=disturbance.seconds,
                code=_SOME_ERROR,
                position=disturbance.position,
            )
        )

    def disarm(self) -> int:
        """Drop the plans; return how many occurred."""
        faults = self._simulator.faults
        met = len(faults.fired)
        faults.clear()
        faults.fired.clear()
        return met + self.acts.clear() + self.impatience.clear()

    def select_by_hand(self, tool: int) -> None:
        """Select a tool at the pendant."""
        self._simulator.machine.tools.select(tool)

    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Write a tool at the pendant."""
        self._simulator.machine.tools.set(tool, offset)
        self.note_hand(tool, offset)

    def repair(self) -> None:
        """Release, close the guard, switch back to automatic; restart after a serious error."""
        panel, condition = self._simulator.panel, self._simulator.condition
        panel.release_estop()
        panel.close_guard()
        panel.auto()
        if condition.serious:
            self._simulator.restart()

    def _requested(self, _number: int, text: str) -> None:
        repeated = FaultAction.DUPLICATE_REQUEST in {f.action for f in self._simulator.faults.fired}
        if _MOVES.match(text) and not repeated:
            self._moves += 1
        for _ in self.acts.due(text):
            old = self.state().tools.get(1, ToolOffset(12.0, -3.5, -20.0))
            self.write_by_hand(1, ToolOffset(old.x_mm + 0.5, old.y_mm - 0.25, old.z_mm))


class TappedTransport(BentTransport):
    """A process's connection, on which the adversary sees all traffic.

    Args:
        simulator: The controller.
        device: The far end: the controller's network, or its serial line.
        clock: The virtual time.
        process: The process of the connection.
        tap: Receives the traffic.
        address: Its URL.

    Attributes:
        impatience: Movements for which the controller gives up waiting.
    """

    impatience: CountedActs | None = None

    def __init__(
        self,
        simulator: EpsonSimulator,
        device: WireDevice,
        clock: ManualClock,
        process: VirtualProcess,
        tap: WireTap,
        address: str,
    ) -> None:
        self._process = process
        self._tap = tap
        self._given_up = self._last = ""
        self._early = self._swallows = False
        super().__init__(parse_url(address), device, clock, simulator.lock, durable=True)

    def told(self, data: bytes, *, secret: bool) -> str:
        """Return a request as text."""
        return "$Login" if secret else data.decode("ascii", "replace").strip()

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        """See :meth:`robolink.transport.Transport.send`."""
        text = self.told(data, secret=secret)
        if self.line is not None:
            self.line.announce(text)
        self._tap.leaving(self._process, replace(_classified(text), forbidden=self._given_up))
        self._last = text
        if self.impatience is not None and self.impatience.due(text) and _MOVES.match(text):
            self._early = True
        try:
            super().send(data, deadline=deadline, secret=secret)
        except TransportError:
            self._process.cut_off = True
            raise
        self._tap.passed(self._process, f"wire sent {text}")

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`."""
        try:
            data = super().receive(deadline=deadline)
        except TransportError:
            # Any later answers would be taken for the wrong requests.
            self._process.cut_off = True
            self._given_up = f"the answer to {self._last} was given up"
            raise
        self._process.cut_off |= not data
        # The echo of an altered login is the driver's to hide, not ours to write down.
        shown = repr(data).replace(PASSWORD, "***")
        self._tap.passed(self._process, f"wire received {shown}")
        return data

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """See :meth:`robolink.transport.Transport.wait_readable`."""
        return self._early or super().wait_readable(deadline=deadline)

    def _taken(self) -> bytes | None:
        """Return what has arrived; the end of a movement that was given up never does."""
        if self._early:
            self._early, self._swallows = False, True
            return b"!Execute,19\r\n"
        data = super()._taken()
        if not data or not self._swallows:
            return data
        left, count = _EXECUTED.subn(b"", data, count=1)
        self._swallows = not count
        return left or None


def _classified(text: str) -> SentRequest:
    written = _WRITES.match(text)
    if written:
        return SentRequest(SentKind.WRITE, text, int(written.group(1) or written.group(2)))
    selected = _SELECTS.match(text)
    if selected:
        return SentRequest(SentKind.SELECT, text, int(selected.group(1)))
    if _MOVES.match(text):
        return SentRequest(SentKind.MOVE, text)
    return SentRequest(SentKind.STOP if _STOPS.match(text) else SentKind.OTHER, text)


class EpsonSerialPlant(EpsonPlant):
    """An EPSON SCARA on Remote RS232, built from the same parts as :class:`EpsonPlant`."""

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap, seed)
        self._port = LinePort(DeviceOnLine(self.simulator, self.simulator.connect_serial))
        self._line = BentLine()
        self._dialect = serial_dialect(self.simulator.options)

    def line_of(self, process: VirtualProcess) -> EpsonLine:
        """Open the port and activate the line."""
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
        """See :meth:`EpsonPlant.arm`; a line also alters bytes."""
        if disturbance.kind is Hindrance.LINE:
            self._line.acts.plan(disturbance)
        else:
            super().arm(disturbance)

    def disarm(self) -> int:
        """See :meth:`EpsonPlant.disarm`."""
        return super().disarm() + self._line.acts.clear()

    @property
    def bent(self) -> bool:
        """See ``PlantMachine.bent``; the line may have altered something, too."""
        return super().bent or bool(self._line.acts.met)


class TappedLine(TappedTransport):
    """A process's session on the line, whose frames the adversary reads.

    A reactivated line is another link: a request forbidden over one is not over the next.
    """

    def told(self, data: bytes, *, secret: bool) -> str:
        """Return a request as text, written as on a network."""
        if secret:
            return "$Login"
        codec = EpsonBinaryCodec(Role.DEVICE)
        codec.receive_data(data)
        event = codec.next_event()
        return shown_request(event) if isinstance(event, (Request, BadRequest)) else "EOT"
