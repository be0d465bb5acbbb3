"""Every act by name, for each kind of simulated controller."""

from collections.abc import Mapping
from typing import Final, get_args

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_simulators.control.answers import FlangeTold
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.declared_acts import (
    NUMBER,
    ON,
    Answer,
    ControlAct,
    Given,
    Taken,
    panel_act,
    shown_flange,
)
from robolink_simulators.control.wire_acts import KEEPING_ACTS, WIRE_ACTS
from robolink_simulators.control.world_acts import WORLD_ACTS
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.panel import EpsonPanel
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.faults.links import LinkKind
from robolink_simulators.not_now import NotNowError
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.plc.device import MappedPlcPanel
from robolink_simulators.softmotion.mailbox.panel import PlcPanel
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator
from robolink_simulators.softmotion.smc_errors import BlockRefused


def _teach_point(cell: ControlledCell, given: Given) -> Answer:
    """Turn the tool to an angle, jog its tip onto the pin, and teach the flange pose there."""
    flange = _epson(cell).world.operator.teach_point(given["number"], given["u_deg"])
    return {"flange": shown_flange(flange)}


def _push(cell: ControlledCell, given: Given) -> Answer:
    """Send every client a line without a request."""
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
"""Acts on an EPSON controller."""


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
"""Acts on a PLC with a mailbox."""

MAPPED_ACTS: Final[tuple[ControlAct, ...]] = (
    panel_act(MappedPlcPanel, "give_permit"),
    panel_act(MappedPlcPanel, "withdraw_permit"),
    ControlAct("cut_link", _cut_link),
)
"""Acts on a PLC with a register map."""


class UnknownActError(ConfigError):
    """This kind of controller has no act of that name."""


MACHINE_REFUSALS: Final = (SpelRefusal, BlockRefused)
"""Exceptions raised by an act that the simulated robot cannot carry out."""


def machine_refusal(refused: Exception) -> tuple[str, str]:
    """Return the sentence of such an error, and what to do next."""
    return str(refused), tr("Nothing was changed. Ask for what this machine can do.")


def defect(error: Exception) -> tuple[str, str]:
    """Return the sentence for an unexpected failure of an act, and what to do next."""
    return (
        tr("The simulator failed: {cause}.", cause=f"{type(error).__name__}: {error}"),
        tr("That is a defect of the simulator: please report it."),
    )


def _by_name(*families: tuple[ControlAct, ...]) -> dict[str, ControlAct]:
    return {act.name: act for family in families for act in family}


ACTS: Final[Mapping[str, Mapping[str, ControlAct]]] = {
    "epson": _by_name(WORLD_ACTS, KEEPING_ACTS, WIRE_ACTS, EPSON_ACTS),
    "softmotion": _by_name(WORLD_ACTS, KEEPING_ACTS, WIRE_ACTS, PLC_ACTS),
    "plc": _by_name(KEEPING_ACTS, WIRE_ACTS, MAPPED_ACTS),
}
"""Acts by kind of controller, then by name."""


def texts_of(name: str) -> frozenset[str]:
    """Return which values of an act are texts, at any kind: a shell cannot tell "007" from 7."""
    acts = [of_kind[name] for of_kind in ACTS.values() if name in of_kind]
    return frozenset(taken.name for act in acts for taken in act.takes if taken.form == "text")


def act_named(cell: ControlledCell, name: object) -> ControlAct:
    """Return an act of a cell.

    Raises:
        UnknownActError: There is none of that name.
    """
    acts = ACTS[cell.simulator.kind]
    act = acts.get(str(name))
    if act is None:
        raise UnknownActError(
            tr("The simulator cannot do {act!r}.", act=name),
            remedy=known_names(acts, name),
        )
    return act


def methods_of(cell: ControlledCell, name: str) -> tuple[str, ...]:
    """Return the HTTP methods of an act: also GET, if it changes nothing.

    Raises:
        UnknownActError: No kind of controller has it.
    """
    # An act of another kind of controller is refused as such, not for its HTTP method.
    known = [of_kind[name] for of_kind in ACTS.values() if name in of_kind]
    act = known[0] if known else act_named(cell, name)
    return ("GET", "POST") if act.reads else ("POST",)


def perform(cell: ControlledCell, name: object, given: Given) -> Answer:
    """Carry out an act at the present time, and return its result.

    Args:
        cell: Where.
        name: Of the act.
        given: What it takes, by name.

    Raises:
        ConfigError: There is no such act, or a value is missing, wrong or unknown.
        SpelRefusal, BlockRefused: The simulated robot cannot do it.
    """
    act = act_named(cell, name)
    checked = act.checked(given)
    with cell.simulator.acting():
        return act.carry_out(cell, checked)
