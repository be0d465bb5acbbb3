"""A PLC with the machine builder's own registers in a virtual cell, and its line."""

import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.in_process.transport import LinePort
from robolink_simulators.hosting.modbus_frames import decode
from robolink_simulators.plc.device import PlcSimulator
from robolink_simulators.plc.serving import plc_on_line

from robolink.controllers.plc_map.controller import PlcMapController
from robolink.model import Controller, OutcomeLog, ToolOffset
from robolink.register_maps import RegisterMap, confirmation_of, load_map
from robolink.testing import confirm_whole_map
from robolink.timing import Deadline
from robolink.transport import parse_url
from robolink.transport.modbus.client import ModbusClient
from robolink.transport.modbus.frames import RtuFraming
from robolink.transport.modbus.rtu import RtuExchange
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import Disturbance, Hindrance
from tests.soak.adversary.plant.lines import BentLine, BentTransport
from tests.soak.adversary.plant.machine import (
    MachineState,
    PlantMachine,
    SentKind,
    SentRequest,
    WireTap,
)
from tests.soak.adversary.plant.softmotion import RTU_LINE

_UNIT: Final = 1
_TIMEOUT_S: Final = 1.0
_REFUSED: Final = 7
_TOOLS: Final = (1, 2, 3, 4)
_MAP: Final = (
    """\
schema = "robolink/plc-map/1"
name = "dispenser of a virtual cell"

[numbers]
table = "holding"
type = "REAL"
word_order = "low_first"
"""
    + "".join(
        f"""
[[tools]]
number = {tool}
x = {{ address = {100 * tool} }}
y = {{ address = {100 * tool + 2} }}
z = {{ address = {100 * tool + 4} }}
u = {{ address = {100 * tool + 6} }}
"""
        for tool in _TOOLS
    )
    + """
[commit]
kind = "commit_bit"
trigger = { table = "coil", address = 20 }
done = { table = "discrete", address = 0 }
busy = { table = "discrete", address = 1 }
error = { table = "discrete", address = 2 }
error_code = { table = "input", address = 10 }
timeout_s = 2.0

[probe]
table = "input"
address = 20
value = 12.3456

[permit]
table = "discrete"
address = 3

[selected]
table = "input"
address = 11
"""
)


@cache
def _register_map() -> RegisterMap:
    with tempfile.TemporaryDirectory(prefix="soak-map-") as folder:
        path = Path(folder) / "dispenser.toml"
        path.write_text(_MAP, encoding="ascii")
        return load_map(path)


class RegisterMapPlant(PlantMachine):
    """A PLC accessed by a map over Modbus RTU.

    Args:
        clock: The virtual time.
        tap: Receives all wire traffic.
        seed: Decides its tools.
    """

    kind = "plc"
    moved_by_robolink = False
    address = "plc+modbus-rtu:///dev/map-cell?map=cell.toml"

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int) -> None:
        super().__init__(clock, tap)
        self._simulator = PlcSimulator(_register_map(), unit=_UNIT, seed=seed)
        self._port = LinePort(plc_on_line(self._simulator))
        self._line = BentLine()
        self._open: dict[int, ModbusClient] = {}

    @property
    def simulator(self) -> PlcSimulator:
        """The simulated PLC."""
        return self._simulator

    def prepare(self, person: WorldParameters) -> None:
        """Do nothing: robolink does not measure here; people type values measured elsewhere."""

    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Open the port, synchronize with the unit and compare the probe."""
        transport = BentTransport(
            parse_url(self.address), self._port, self.clock, self._simulator.lock, durable=True
        )
        transport.line = self._line
        exchange = RtuExchange(transport, self.address, RTU_LINE, RtuFraming())
        client = ModbusClient(
            transport, exchange, identity=self.address, unit=_UNIT, timeout_s=_TIMEOUT_S
        )
        self._open[process.number] = client
        try:
            exchange.get_in_step(_UNIT, Deadline.after(self.clock, _TIMEOUT_S))
            tapped = TappedRegisters(self, client, process)
            controller = PlcMapController(tapped, _register_map(), outcomes)
            controller.require_probe()
            # The installer of the cell compared each value with the screen of the machine.
            if confirmation_of(controller.who().name, controller.register_map) is None:
                confirm_whole_map(controller)
        except BaseException:
            client.close()
            raise
        return controller

    def hang_up(self, process: VirtualProcess) -> None:
        """Close the port of a process that died, as the system does."""
        client = self._open.pop(process.number, None)
        if client is not None:
            client.close()

    def state(self) -> MachineState:
        """Return the values that the machine uses."""
        self.advance()
        return MachineState(_offsets(self._simulator.program.in_force), 1)

    def staged(self) -> Mapping[int, ToolOffset]:
        """Return the register values that the machine does not use yet."""
        program = self._simulator.program
        shown = _offsets(program.shown())
        return {n: one for n, one in shown.items() if one != _offsets(program.in_force)[n]}

    def shown(self, tool: int) -> ToolOffset | None:
        """Return the register values, whether the machine uses them or not."""
        numbers, memory = _register_map().slots[tool].components, self._simulator.program.memory
        x, y, z, u = (
            decode(numbers[name], memory.read(numbers[name].table, numbers[name].registers))
            for name in ("x", "y", "z", "u")
        )
        return ToolOffset(x, y, z, u)

    @property
    def moving(self) -> bool:
        """False: the machine moves without robolink, and unobserved."""
        return False

    @property
    def movements(self) -> int:
        """Zero: robolink begins no movement."""
        return 0

    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the line or the PLC."""
        if disturbance.kind is Hindrance.WIRE:
            self._simulator.faults.add(
                Fault(
                    FaultAction[disturbance.what],
                    disturbance.at,
                    disturbance.match,
                    seconds=disturbance.seconds,
                    position=disturbance.position,
                )
            )
        elif disturbance.kind is Hindrance.LINE:
            self._line.acts.plan(disturbance)
        else:
            self.acts.plan(disturbance)

    def disarm(self) -> int:
        """Drop the plans; return how many occurred."""
        faults = self._simulator.faults
        met = len(faults.fired) + self.acts.clear() + self._line.acts.clear()
        faults.clear()
        faults.fired.clear()
        return met

    @property
    def bent(self) -> bool:
        """See ``PlantMachine.bent``; the line may have altered something, too."""
        return super().bent or bool(self._line.acts.met)

    def write_by_hand(self, tool: int, offset: ToolOffset) -> None:
        """Let a person at the HMI give a tool other values."""
        x, y, z, u, *_ = offset.components()
        self._simulator.program.set_tool(tool, {"x": x, "y": y, "z": z, "u": u})
        self.note_hand(tool, offset)

    def select_by_hand(self, tool: int) -> None:
        """Let a person at the HMI choose a tool."""
        self._simulator.program.select(tool)

    def finest(self, value: float) -> float:
        """See ``PlantMachine.finest``: one unit in the last place of a REAL."""
        return max(1e-7, abs(value) * 2e-7)

    def repair(self) -> None:
        """Permit, let the program answer again, and show the values in use on the HMI."""
        program = self._simulator.program
        program.permit(True)
        program.silent, program.refuse_with = False, None

    def leaves(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Note a request before it leaves, and run the events planned for it."""
        self.tap.leaving(process, sent)
        self._line.announce(sent.text)
        for disturbance in self.acts.due(sent.text):
            self._let_happen(disturbance)

    def _let_happen(self, disturbance: Disturbance) -> None:
        program = self._simulator.program
        if disturbance.kind is Hindrance.PENDANT:
            held = self.state().tools[1]
            self.write_by_hand(1, ToolOffset(held.x_mm, held.y_mm, held.z_mm + 0.5, held.u_deg))
            return
        match disturbance.what:
            case "WITHDRAW_PERMIT":
                program.permit(False)
            case "SILENT":
                program.silent = True
            case "REFUSE":
                program.refuse_with = _REFUSED
            case _:
                program.start_anew()


def _offsets(tools: Mapping[int, Mapping[str, float]]) -> dict[int, ToolOffset]:
    return {n: ToolOffset(one["x"], one["y"], one["z"], one["u"]) for n, one in tools.items()}


class TappedRegisters:
    """A Modbus client on which the adversary sees all traffic.

    Args:
        plant: Receives the traffic.
        client: Carries it.
        process: The process of the client.
    """

    def __init__(
        self, plant: RegisterMapPlant, client: ModbusClient, process: VirtualProcess
    ) -> None:
        self._plant = plant
        self._client = client
        self._process = process
        self.identity = client.identity
        self.place = client.place
        self.clock = client.clock
        self.close = client.close
        self.most_registers = client.most_registers

    def read_holding(self, address: int, count: int) -> tuple[int, ...]:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        self._asks(3, address)
        words = self._client.read_holding(address, count)
        self._plant.tap.passed(self._process, f"wire received {words}")
        return words

    def read_input(self, address: int, count: int) -> tuple[int, ...]:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        self._asks(4, address)
        return self._client.read_input(address, count)

    def read_coils(self, address: int, count: int) -> tuple[bool, ...]:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        self._asks(1, address)
        return self._client.read_coils(address, count)

    def read_discrete(self, address: int, count: int) -> tuple[bool, ...]:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        self._asks(2, address)
        return self._client.read_discrete(address, count)

    def write_registers(self, address: int, values: Sequence[int]) -> None:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        text = f"fc16 {address} {' '.join(f'{value:04x}' for value in values)}"
        tool = address // 100 if address // 100 in _TOOLS else None
        kind = SentKind.OTHER if tool is None else SentKind.WRITE
        self._plant.leaves(self._process, SentRequest(kind, text, tool))
        self._client.write_registers(address, values)
        self._plant.tap.passed(self._process, f"wire sent {text}")

    def write_coil(self, address: int, value: bool) -> None:
        """See :class:`robolink.controllers.plc_map.link.RegisterClient`."""
        text = f"fc5 {address} {int(value)}"
        self._plant.leaves(self._process, SentRequest(SentKind.OTHER, text))
        self._client.write_coil(address, value)
        self._plant.tap.passed(self._process, f"wire sent {text}")

    def _asks(self, function: int, address: int) -> None:
        request = SentRequest(SentKind.OTHER, f"fc{function} {address}")
        self._plant.leaves(self._process, request)
