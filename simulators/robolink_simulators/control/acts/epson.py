"""What a person does at the panel and with the pendant of an EPSON cell."""

from typing import Final

from robolink_simulators.control.acts.answers import FlangeTold
from robolink_simulators.control.acts.declared import (
    NUMBER,
    ON,
    Answer,
    ControlAct,
    Given,
    Taken,
    panel_act,
    shown_flange,
)
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.panel import EpsonPanel


def _teach_point(cell: ControlledCell, given: Given) -> Answer:
    """Turn the tool to an angle, jog its tip onto the pin, and teach the flange pose there."""
    flange = _epson(cell).world.operator.teach_point(given["number"], given["u_deg"])
    return {"flange": shown_flange(flange)}


def _push(cell: ControlledCell, given: Given) -> Answer:
    """Send every client a line that nobody asked for."""
    _epson(cell).push(given["text"].encode("ascii") + b"\r\n")
    return {}


def _epson(cell: ControlledCell) -> EpsonSimulator:
    if not isinstance(cell.simulator, EpsonSimulator):
        raise TypeError(cell.simulator.kind)
    return cell.simulator


EPSON_ACTS: Final = (
    ControlAct(
        "teach_point",
        _teach_point,
        (NUMBER, Taken("u_deg", least=-360, most=360)),
        gives=FlangeTold,
    ),
    ControlAct("push", _push, (Taken("text", "text", ascii=True),)),
    panel_act(EpsonPanel, "set_input", NUMBER, ON, method="switch_input"),
    panel_act(EpsonPanel, "teach"),
    panel_act(EpsonPanel, "auto"),
    panel_act(EpsonPanel, "press_estop"),
    panel_act(EpsonPanel, "release_estop"),
    panel_act(EpsonPanel, "open_guard"),
    panel_act(EpsonPanel, "close_guard"),
    panel_act(EpsonPanel, "raise_error", NUMBER),
    panel_act(EpsonPanel, "raise_warning", NUMBER),
    panel_act(EpsonPanel, "raise_alarm", NUMBER),
    panel_act(EpsonPanel, "raise_serious_error"),
    panel_act(EpsonPanel, "set_monitoring_only", Taken("on", "flag")),
    panel_act(EpsonPanel, "start_production"),
    panel_act(EpsonPanel, "stop_production"),
    panel_act(EpsonPanel, "lose_login"),
    panel_act(EpsonPanel, "cut_link"),
)
"""Acts at an EPSON controller."""
