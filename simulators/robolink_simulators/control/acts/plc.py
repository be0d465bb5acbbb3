"""What a person, or the machine's own program, does at a PLC."""

from typing import Final, get_args

from robolink_simulators.control.acts.declared import NUMBER, ON, ControlAct, Taken, panel_act
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.plc.panel import MappedPlcPanel
from robolink_simulators.softmotion.mailbox.panel import PlcPanel

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
    panel_act(PlcPanel, "lay_words", Taken("order", "text", choices=get_args(Order))),
    panel_act(PlcPanel, "shift_map", Taken("words", "whole", most=64)),
)
"""Acts at a PLC with a mailbox."""

MAPPED_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act(MappedPlcPanel, "give_permit"),
    panel_act(MappedPlcPanel, "withdraw_permit"),
    panel_act(MappedPlcPanel, "cut_link"),
)
"""Acts at a PLC with a register map."""
