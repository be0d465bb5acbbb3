"""What a person, or the machine's own program, does at a PLC."""

from typing import Final, get_args

from robolink.messages import tr
from robolink_simulators.control.acts.declared import (
    NUMBER,
    ON,
    Answer,
    ControlAct,
    Given,
    Taken,
    panel_act,
)
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.faults.links import LinkKind
from robolink_simulators.not_now import NotNowError
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.plc.panel import MappedPlcPanel
from robolink_simulators.softmotion.mailbox.panel import PlcPanel
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_NO_CONNECTION: Final = frozenset({LinkKind.MODBUS_RTU, LinkKind.CAN, LinkKind.PLC_RTU})


def _cut_link(cell: ControlledCell, _given: Given) -> Answer:
    """Pull the cable of the client that is logged in."""
    if _NO_CONNECTION.issuperset(cell.links):
        raise NotNowError(
            tr("A serial line or a CAN bus has no connection that could be cut."),
            remedy=tr("Plan a fault of the wire there, for example drop_reply."),
        )
    if isinstance(cell.simulator, (SoftMotionSimulator, PlcSimulator)):
        cell.simulator.panel.cut_link()
    return {}


PLC_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act(PlcPanel, "set_input", NUMBER, ON, method="switch_input"),
    panel_act(PlcPanel, "press_estop"),
    panel_act(PlcPanel, "release_estop"),
    panel_act(PlcPanel, "give_permit"),
    panel_act(PlcPanel, "withdraw_permit"),
    panel_act(PlcPanel, "take_change_back"),
    panel_act(PlcPanel, "fail_axis", NUMBER),
    panel_act(PlcPanel, "move_axis", NUMBER, Taken("target")),
    panel_act(PlcPanel, "zero_inputs"),
    panel_act(PlcPanel, "freeze"),
    panel_act(PlcPanel, "thaw"),
    panel_act(PlcPanel, "freeze_heartbeat"),
    panel_act(PlcPanel, "take_ownership"),
    ControlAct("cut_link", _cut_link),
    panel_act(PlcPanel, "lay_words", Taken("order", "text", choices=get_args(Order))),
    panel_act(PlcPanel, "shift_map", Taken("words", "whole", most=64)),
)
"""Acts at a PLC with a mailbox."""

MAPPED_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act(MappedPlcPanel, "give_permit"),
    panel_act(MappedPlcPanel, "withdraw_permit"),
    ControlAct("cut_link", _cut_link),
)
"""Acts at a PLC with a register map."""
