"""Whether a controller says of itself that nothing real moves."""

import re
from typing import Final

from robolink.errors import ControllerError
from robolink.model import Controller

_SERIAL: Final = re.compile(r"(C-)?SIM[0-9A-F]{8}")
"""Serial numbers of simulated EPSON controllers and robots; no other maker's are known."""


def says_it_is_simulated(controller: Controller) -> bool:
    """Tell whether a controller says so; only reads, and no answer is no yes.

    A PLC says it of its axes, in the mailbox; a simulated EPSON controller by its serial numbers;
    what runs in this process by its URL.

    Args:
        controller: The controller, connected.

    Example:
        >>> import robolink
        >>> from robolink.controllers import says_it_is_simulated
        >>> from robolink.testing import MemoryController
        >>> with robolink.connect("epson+sim://simulated-example") as controller:
        ...     says_it_is_simulated(controller), says_it_is_simulated(MemoryController())
        (True, False)
    """
    if "+sim://" in controller.identity:
        return True
    try:
        if controller.condition().get("simulated") is True:
            return True
        facts = controller.facts()
    except ControllerError:
        return False
    serials = (facts.controller_serial or "", *facts.robot_serials)
    return any(_SERIAL.fullmatch(serial) for serial in serials)
