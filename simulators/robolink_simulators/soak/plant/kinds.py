"""Which machine stands in which kind of cell, where robolink is the one that acts."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.soak.history import CellKind
from robolink_simulators.soak.plant.canopen import CanopenPlant
from robolink_simulators.soak.plant.epson import EpsonPlant
from robolink_simulators.soak.plant.epson_serial import EpsonSerialPlant
from robolink_simulators.soak.plant.machine import PlantMachine, WireTap
from robolink_simulators.soak.plant.modbus import ModbusRtuPlant, ModbusTcpPlant
from robolink_simulators.soak.plant.register_map import RegisterMapPlant
from robolink_simulators.soak.plant.softmotion import SoftMotionPlant

PLANTS: Final[Mapping[CellKind, Callable[[ManualClock, WireTap, int], PlantMachine]]] = {
    CellKind.EPSON: EpsonPlant,
    CellKind.SOFTMOTION: SoftMotionPlant,
    CellKind.EPSON_SERIAL: EpsonSerialPlant,
    CellKind.MODBUS_TCP: ModbusTcpPlant,
    CellKind.MODBUS_RTU: ModbusRtuPlant,
    CellKind.CANOPEN: CanopenPlant,
    CellKind.REGISTER_MAP: RegisterMapPlant,
}
"""A machine whose own program calls back needs to know whose turn it is, and stands elsewhere."""
