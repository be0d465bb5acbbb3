"""What an assist port can do: all that can be done to a simulated cell past the wire."""

from robolink_simulators.control.acts.declared import Answer, Given
from robolink_simulators.control.acts.registry import perform as perform_act
from robolink_simulators.control.cell import AnySimulator, ControlledCell


def perform(simulator: AnySimulator | ControlledCell, request: Given) -> Answer:
    """Do what ``request["do"]`` names and return what it gives.

    Raises:
        ConfigError: There is no such act, or a value is missing, wrong or unknown.
        SpelRefusal, BlockRefused: The simulated robot cannot do it.
    """
    cell = simulator if isinstance(simulator, ControlledCell) else ControlledCell(simulator)
    given = {name: value for name, value in request.items() if name != "do"}
    return perform_act(cell, request.get("do"), given)
