"""The machine of each kind of cell in which robolink acts."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink_simulators.cell.clock import ManualClock

from tests.soak.adversary.history import CellKind
from tests.soak.adversary.plant.epson import EpsonPlant, EpsonSerialPlant
from tests.soak.adversary.plant.machine import PlantMachine, WireTap
from tests.soak.adversary.plant.register_map import RegisterMapPlant
from tests.soak.adversary.plant.softmotion import (
    CanopenPlant,
    ModbusRtuPlant,
    ModbusTcpPlant,
    OpcuaPlant,
    SoftMotionPlant,
)

PLANTS: Final[Mapping[CellKind, Callable[[ManualClock, WireTap, int], PlantMachine]]] = {
    CellKind.EPSON: EpsonPlant,
    CellKind.SOFTMOTION: SoftMotionPlant,
    CellKind.EPSON_SERIAL: EpsonSerialPlant,
    CellKind.MODBUS_TCP: ModbusTcpPlant,
    CellKind.MODBUS_RTU: ModbusRtuPlant,
    CellKind.CANOPEN: CanopenPlant,
    CellKind.OPCUA: OpcuaPlant,
    CellKind.REGISTER_MAP: RegisterMapPlant,
}
"""The machines by kind. One whose own program calls back must know the turns, and is elsewhere."""
