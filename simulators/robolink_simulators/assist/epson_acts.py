"""What the assist port of an EPSON can do: look at the truth, jog the pin, push buttons."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.assist.parameters import (
    Answer,
    Parameters,
    number_in,
    shown_flange,
    tool_number,
    whole_number,
)
from robolink_simulators.epson.device import EpsonSimulator

Act = Callable[[EpsonSimulator, Parameters], Answer]


def _look(simulator: EpsonSimulator, request: Parameters) -> Answer:
    return asdict(simulator.world.operator.look(tool_number(request)))


def _jog_onto_pin(simulator: EpsonSimulator, request: Parameters) -> Answer:
    return {"flange": shown_flange(simulator.world.operator.jog_onto_pin(tool_number(request)))}


def _teach_point(simulator: EpsonSimulator, request: Parameters) -> Answer:
    u_deg = number_in(request, "u_deg")
    if not -360 <= u_deg <= 360:
        raise ConfigError(
            tr("{act} needs {name}, an angle.", act="teach_point", name="u_deg"),
            remedy=tr("Give it as {example}.", example='"u_deg": 180'),
        )
    flange = simulator.world.operator.teach_point(whole_number(request, "number"), u_deg)
    return {"flange": shown_flange(flange)}


def _change_nozzle(simulator: EpsonSimulator, request: Parameters) -> Answer:
    tool = tool_number(request)
    world = simulator.world
    return {"tip": asdict(world.change_nozzle() if tool is None else world.change_nozzle(tool))}


def _set_input(simulator: EpsonSimulator, request: Parameters) -> Answer:
    simulator.panel.switch_input(whole_number(request, "number"), bool(request.get("on", True)))
    return {}


def _restart(simulator: EpsonSimulator, _request: Parameters) -> Answer:
    simulator.restart()
    return {}


def _counters(simulator: EpsonSimulator, _request: Parameters) -> Answer:
    return {**simulator.counters()}


def _plain(name: str) -> Act:
    def act(simulator: EpsonSimulator, _request: Parameters) -> Answer:
        getattr(simulator.panel, name)()
        return {}

    return act


def _numbered(name: str) -> Act:
    def act(simulator: EpsonSimulator, request: Parameters) -> Answer:
        getattr(simulator.panel, name)(whole_number(request, "number"))
        return {}

    return act


EPSON_ACTS: Final[Mapping[str, Act]] = {
    "look": _look,
    "jog_onto_pin": _jog_onto_pin,
    "teach_point": _teach_point,
    "truth": lambda simulator, _request: simulator.truth(),
    "counters": _counters,
    "change_nozzle": _change_nozzle,
    "set_input": _set_input,
    "teach": _plain("teach"),
    "auto": _plain("auto"),
    "press_estop": _plain("press_estop"),
    "release_estop": _plain("release_estop"),
    "open_guard": _plain("open_guard"),
    "close_guard": _plain("close_guard"),
    "raise_error": _numbered("raise_error"),
    "raise_warning": _numbered("raise_warning"),
    "raise_alarm": _numbered("raise_alarm"),
    "raise_serious_error": _plain("raise_serious_error"),
    "start_production": _plain("start_production"),
    "stop_production": _plain("stop_production"),
    "cut_link": _plain("cut_link"),
    "restart": _restart,
}
"""Every act by name."""
