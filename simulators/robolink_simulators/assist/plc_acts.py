"""What the assist port of a simulated PLC can do: look at the truth, jog the pin, push buttons."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Final

from robolink_simulators.assist.parameters import (
    Answer,
    Parameters,
    shown_flange,
    tool_number,
    whole_number,
)
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

Act = Callable[[SoftMotionSimulator, Parameters], Answer]


def _look(simulator: SoftMotionSimulator, request: Parameters) -> Answer:
    return asdict(simulator.world.operator.look(tool_number(request)))


def _jog_onto_pin(simulator: SoftMotionSimulator, request: Parameters) -> Answer:
    return {"flange": shown_flange(simulator.world.operator.jog_onto_pin(tool_number(request)))}


def _change_nozzle(simulator: SoftMotionSimulator, request: Parameters) -> Answer:
    tool = tool_number(request)
    world = simulator.world
    return {"tip": asdict(world.change_nozzle() if tool is None else world.change_nozzle(tool))}


def _set_input(simulator: SoftMotionSimulator, request: Parameters) -> Answer:
    simulator.panel.switch_input(whole_number(request, "number"), bool(request.get("on", True)))
    return {}


def _fail_axis(simulator: SoftMotionSimulator, request: Parameters) -> Answer:
    simulator.panel.fail_axis(whole_number(request, "number"))
    return {}


def _counters(simulator: SoftMotionSimulator, _request: Parameters) -> Answer:
    return {**simulator.counters()}


def _plain(name: str) -> Act:
    def act(simulator: SoftMotionSimulator, _request: Parameters) -> Answer:
        getattr(simulator.panel, name)()
        return {}

    return act


PLC_ACTS: Final[Mapping[str, Act]] = {
    "look": _look,
    "jog_onto_pin": _jog_onto_pin,
    "truth": lambda simulator, _request: simulator.truth(),
    "counters": _counters,
    "change_nozzle": _change_nozzle,
    "set_input": _set_input,
    "press_estop": _plain("press_estop"),
    "release_estop": _plain("release_estop"),
    "give_permit": _plain("give_permit"),
    "withdraw_permit": _plain("withdraw_permit"),
    "fail_axis": _fail_axis,
    "zero_inputs": _plain("zero_inputs"),
    "freeze": _plain("freeze"),
    "thaw": _plain("thaw"),
    "restart": _plain("restart"),
}
"""Every act by name."""
