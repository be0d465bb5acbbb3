"""What a wizard's second row is read from, while a command has its controller."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from robolink.errors import ControllerError
from robolink_cli.prompts.present import present_desk

if TYPE_CHECKING:
    from robolink.model import Controller

_SERIAL: Final = re.compile(r"(C-)?SIM[0-9A-F]{8}")
"""Serial numbers of simulated EPSON controllers and robots; no other maker's are known."""


@contextmanager
def watched_at_desk(controller: "Controller") -> Iterator[None]:
    """Let the desk of a wizard look at ``controller`` while a person is asked, for the block."""
    desk = present_desk()
    if desk is None:
        yield
        return
    from robolink_cli.wizard.glance import ControllerGlance
    from robolink_cli.wizard.happenings import CellIs

    if _says_it_is_simulated(controller):
        desk.regard(CellIs(simulated=True))
    glance = ControllerGlance(controller)
    before, desk.glance = desk.glance, glance.at_rest
    try:
        with desk.following(glance.on_the_way):
            yield
    finally:
        desk.glance = before


def _says_it_is_simulated(controller: "Controller") -> bool:
    """Tell whether a controller says of itself that nothing real moves; an answer is not guessed.

    A PLC says it of its axes, in the mailbox; a simulated EPSON controller by its serial numbers.
    """
    try:
        if controller.condition().get("simulated") is True:
            return True
        facts = controller.facts()
    except ControllerError:
        return False
    serials = (facts.controller_serial or "", *facts.robot_serials)
    return any(_SERIAL.fullmatch(serial) for serial in serials)
