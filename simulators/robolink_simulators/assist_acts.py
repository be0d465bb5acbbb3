"""What the assist port can do: look at the truth, jog the pin, push buttons."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose
from robolink_simulators.epson.device import EpsonSimulator

Answer = dict[str, object]
Parameters = Mapping[str, Any]
Act = Callable[[EpsonSimulator, Parameters], Answer]


def perform(simulator: EpsonSimulator, request: Parameters) -> Answer:
    """Do what ``request["do"]`` names and return what it gives.

    Raises:
        ConfigError: There is no such act, or a value is missing or wrong.
    """
    act = ACTS.get(str(request.get("do")))
    if act is None:
        raise ConfigError(
            tr("The simulator cannot do {act!r}.", act=request.get("do")),
            remedy=tr("Known are: {acts}.", acts=", ".join(ACTS)),
        )
    return act(simulator, request)


def _look(simulator: EpsonSimulator, request: Parameters) -> Answer:
    return asdict(simulator.world.operator.look(_tool(request)))


def _jog_onto_pin(simulator: EpsonSimulator, request: Parameters) -> Answer:
    return {"flange": _shown(simulator.world.operator.jog_onto_pin(_tool(request)))}


def _shown(flange: Pose) -> dict[str, float]:
    x_mm, y_mm, z_mm, u_deg, _, _ = flange.coordinates()
    return {"x_mm": x_mm, "y_mm": y_mm, "z_mm": z_mm, "u_deg": u_deg}


def _teach_point(simulator: EpsonSimulator, request: Parameters) -> Answer:
    u_deg = request.get("u_deg")
    if not isinstance(u_deg, (int, float)) or not -360 <= u_deg <= 360:
        raise ConfigError(
            tr("{act} needs {name}, an angle.", act="teach_point", name="u_deg"),
            remedy=tr("Give it as {example}.", example='"u_deg": 180'),
        )
    flange = simulator.world.operator.teach_point(_whole(request, "number"), float(u_deg))
    return {"flange": _shown(flange)}


def _change_nozzle(simulator: EpsonSimulator, request: Parameters) -> Answer:
    tool = _tool(request)
    world = simulator.world
    return {"tip": asdict(world.change_nozzle() if tool is None else world.change_nozzle(tool))}


def _set_input(simulator: EpsonSimulator, request: Parameters) -> Answer:
    simulator.machine.inputs.set(_whole(request, "bit"), bool(request.get("on", True)))
    return {}


def _restart(simulator: EpsonSimulator, _request: Parameters) -> Answer:
    simulator.restart()
    return {}


def _counters(simulator: EpsonSimulator, _request: Parameters) -> Answer:
    return {
        "exchanges": simulator.exchanges,
        "moves_started": simulator.machine.arm.moves_started,
        "flash_writes": simulator.machine.flash_writes,
    }


def _plain(name: str) -> Act:
    def act(simulator: EpsonSimulator, _request: Parameters) -> Answer:
        getattr(simulator.panel, name)()
        return {}

    return act


def _numbered(name: str) -> Act:
    def act(simulator: EpsonSimulator, request: Parameters) -> Answer:
        getattr(simulator.panel, name)(_whole(request, "number"))
        return {}

    return act


ACTS: Final[Mapping[str, Act]] = {
    "look": _look,
    "jog_onto_pin": _jog_onto_pin,
    "teach_point": _teach_point,
    "truth": lambda simulator, _request: simulator.world.truth(),
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


def _tool(request: Parameters) -> int | None:
    return _whole(request, "tool") if "tool" in request else None


def _whole(request: Parameters, name: str) -> int:
    value = request.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= 9999:
        raise ConfigError(
            tr(
                "{act} needs {name}, a whole number from 0 to 9999.",
                act=request.get("do"),
                name=name,
            ),
            remedy=tr("Give it as {example}.", example=f'"{name}": 1'),
        )
    return value
