"""What can go wrong with each kind of cell: on its link, and with its machine."""

from collections.abc import Mapping
from typing import Final

from robolink_simulators.faults import FaultAction, LinkKind, PlcFaultAction, links_of
from robolink_simulators.faults.drawn import ONLY_BY_NAME
from robolink_simulators.soak.history import CellKind

MAILBOX_KINDS: Final = frozenset(
    {CellKind.SOFTMOTION, CellKind.MODBUS_TCP, CellKind.MODBUS_RTU, CellKind.CANOPEN}
)
LINE_KINDS: Final = frozenset({CellKind.EPSON_SERIAL, CellKind.MODBUS_RTU, CellKind.REGISTER_MAP})
"""Cells with a serial line, whose bytes may be lost, swapped, bent and added to."""

_LINKS: Final = {
    CellKind.EPSON: LinkKind.EPSON_SIM,
    CellKind.EPSON_SERIAL: LinkKind.EPSON_SERIAL,
    CellKind.SOFTMOTION: LinkKind.MAILBOX_SIM,
    CellKind.MODBUS_TCP: LinkKind.MODBUS_TCP,
    CellKind.MODBUS_RTU: LinkKind.MODBUS_RTU,
    CellKind.CANOPEN: LinkKind.CAN,
    CellKind.REGISTER_MAP: LinkKind.PLC_RTU,
}
_OF_EPSON: Final = (
    FaultAction.ESTOP,
    FaultAction.GUARD_OPEN,
    FaultAction.DEVICE_FAULT,
    FaultAction.SERIOUS_ERROR,
    FaultAction.RESTART,
    FaultAction.LOSE_LOGIN,
    FaultAction.TEACH_MODE,
)
_OF_MAILBOX: Final = (
    PlcFaultAction.ESTOP,
    PlcFaultAction.AXIS_ERROR,
    PlcFaultAction.RESTART,
    PlcFaultAction.FREEZE,
    PlcFaultAction.FREEZE_HEARTBEAT,
    PlcFaultAction.WITHDRAW_PERMIT,
    PlcFaultAction.TAKE_OWNERSHIP,
    PlcFaultAction.WORD_ORDER,
    PlcFaultAction.SHIFT_MAP,
)
_OF_MACHINES: Final = frozenset((*_OF_EPSON, *_OF_MAILBOX))
_NOT_OF_WIRES: Final = _OF_MACHINES | ONLY_BY_NAME


def _machine_faults(kind: CellKind) -> tuple[str, ...]:
    match kind:
        case CellKind.EPSON:
            return (*(action.name for action in _OF_EPSON), "GIVES_UP")
        case CellKind.EPSON_SERIAL:
            return tuple(action.name for action in _OF_EPSON)
        case CellKind.REGISTER_MAP:
            return ("WITHDRAW_PERMIT", "SILENT", "REFUSE", "RESTART")
        case CellKind.PROGRAM:
            return ("RESTART", "ESTOP", "PIN_BUMPED", "TOUCH_BESIDE")
    link = _LINKS[kind]
    return tuple(action.name for action in _OF_MAILBOX if link in links_of(action))


def _wire_faults(kind: CellKind) -> tuple[str, ...]:
    if kind is CellKind.PROGRAM:
        return (
            "DROP_ASKED",
            "DROP_ANSWERED",
            "BEND_ASKED",
            "BEND_ANSWERED",
            "CUT_BEFORE",
            "CUT_AFTER",
        )
    family = PlcFaultAction if kind in MAILBOX_KINDS else FaultAction
    link = _LINKS[kind]
    return tuple(
        action.name for action in family if action not in _NOT_OF_WIRES and link in links_of(action)
    )


MACHINE_FAULTS: Final[Mapping[CellKind, tuple[str, ...]]] = {
    kind: _machine_faults(kind) for kind in CellKind
}
"""What happens to the machine itself, by name."""

WIRE_FAULTS: Final[Mapping[CellKind, tuple[str, ...]]] = {
    kind: _wire_faults(kind) for kind in CellKind
}
"""What happens on the wire, by name."""
