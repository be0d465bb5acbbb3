"""What an assist port can do, whatever it stands beside."""

from collections.abc import Callable, Mapping
from functools import partial

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.assist.epson_acts import EPSON_ACTS
from robolink_simulators.assist.parameters import Answer, Parameters
from robolink_simulators.assist.plc_acts import PLC_ACTS
from robolink_simulators.assist.world_acts import WORLD_ACTS
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import fault_as_keys
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

Assisted = EpsonSimulator | SoftMotionSimulator
"""A simulator with a person beside it."""


def perform(simulator: Assisted, request: Parameters) -> Answer:
    """Do what ``request["do"]`` names and return what it gives.

    Raises:
        ConfigError: There is no such act, or a value is missing or wrong.
        Refusal, Refused: The simulated robot cannot do it.
    """
    acts = _acts_at(simulator)
    act = acts.get(str(request.get("do")))
    if act is None:
        raise ConfigError(
            tr("The simulator cannot do {act!r}.", act=request.get("do")),
            remedy=tr("Known are: {acts}.", acts=", ".join(acts)),
        )
    return act(request)


def _acts_at(simulator: Assisted) -> Mapping[str, Callable[[Parameters], Answer]]:
    world: dict[str, Callable[[Parameters], Answer]] = {
        name: partial(act, simulator.world) for name, act in WORLD_ACTS.items()
    }
    world["faults"] = partial(_faults, simulator)
    if isinstance(simulator, EpsonSimulator):
        return {name: partial(act, simulator) for name, act in EPSON_ACTS.items()} | world
    return {name: partial(act, simulator) for name, act in PLC_ACTS.items()} | world


def _faults(simulator: Assisted, _request: Parameters) -> Answer:
    return {
        "fired": [fault_as_keys(fault) for fault in simulator.faults.fired],
        "pending": [fault_as_keys(fault) for fault in simulator.faults.pending],
    }
