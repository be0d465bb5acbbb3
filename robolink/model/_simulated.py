"""Whether a controller is a simulated one. What says nothing of it is never called real."""

import re
from typing import Final

from robolink.errors import ControllerError
from robolink.model._controller import Controller
from robolink.model._identity import ControllerFacts

_SERIAL: Final = re.compile(r"(?:C-)?SIM[0-9A-F]{8}")
"""Serial numbers of simulated EPSON controllers and robots; no other maker's are known."""

_MEDIUM: Final = "+sim://"
"""In the URL of a simulator that runs in the process that uses it."""


def is_simulated_name(name: str) -> bool:
    """Tell whether the name of a controller, or a serial number, is a simulator's.

    ``False`` says nothing: the name of a PLC does not tell.

    Args:
        name: An identity, an address or a serial number.

    Example:
        >>> from robolink.model import is_simulated_name
        >>> is_simulated_name("epson:C-SIM0A1B2C3D/SIM0A1B2C3D"), is_simulated_name("softmotion:1A")
        (True, False)
    """
    parts = re.split(r"[:/+#]", name)
    return _MEDIUM in name or any(map(_SERIAL.fullmatch, parts))


def are_simulated_facts(facts: ControllerFacts) -> bool:
    """Tell whether the serial numbers of a controller or its robots are a simulator's."""
    return any(map(is_simulated_name, (facts.controller_serial or "", *facts.robot_serials)))


def says_it_is_simulated(controller: Controller, facts: ControllerFacts | None = None) -> bool:
    """Tell whether a controller says of itself that nothing real moves; an answer is not guessed.

    A PLC says it of its axes, in the mailbox (docs/mailbox.md); a simulated EPSON controller by
    its serial numbers. One that cannot be asked just now says nothing.

    Args:
        controller: The controller; what can be read is read.
        facts: What it said of itself, where it was asked already.

    Example:
        >>> from robolink import connect
        >>> from robolink.model import says_it_is_simulated
        >>> with connect("softmotion+sim://simulated-example") as controller:
        ...     says_it_is_simulated(controller)
        True
    """
    if is_simulated_name(controller.identity):
        return True
    try:
        if are_simulated_facts(controller.facts() if facts is None else facts):
            return True
        return controller.condition().get("simulated") is True
    except ControllerError:
        return False
