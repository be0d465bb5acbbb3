"""What a person, or the machine's own program, does at a PLC."""

from typing import Final, get_args

from robolink_simulators.control.acts.declared import NUMBER, ON, ControlAct, Taken, panel_act
from robolink_simulators.faults.fieldbus import Order

PLC_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act("set_input", NUMBER, ON, method="switch_input"),
    panel_act("press_estop"),
    panel_act("release_estop"),
    panel_act("give_permit"),
    panel_act("withdraw_permit"),
    panel_act("take_change_back"),
    panel_act("fail_axis", NUMBER),
    panel_act("move_axis", NUMBER, Taken("target")),
    panel_act("zero_inputs"),
    panel_act("freeze"),
    panel_act("thaw"),
    panel_act("freeze_heartbeat"),
    panel_act("take_ownership"),
    panel_act("lay_words", Taken("order", "text", choices=get_args(Order))),
    panel_act("shift_map", Taken("words", "whole", most=64)),
)
"""Acts at a PLC with a mailbox."""

MAPPED_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act("give_permit"),
    panel_act("withdraw_permit"),
    panel_act("cut_link"),
)
"""Acts at a PLC with a register map."""
