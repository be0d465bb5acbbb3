"""What a wizard's second row is read from, while a command has its controller."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from robolink.model import says_it_is_simulated
from robolink_cli.prompts.present import present_desk

if TYPE_CHECKING:
    from robolink.model import Controller


@contextmanager
def watched_at_desk(controller: "Controller") -> Iterator[None]:
    """Let the desk of a wizard look at ``controller`` while a person is asked, for the block."""
    desk = present_desk()
    if desk is None:
        yield
        return
    from robolink_cli.wizard.glance import ControllerGlance
    from robolink_cli.wizard.happenings import CellIs

    if says_it_is_simulated(controller):
        desk.regard(CellIs(simulated=True))
    glance = ControllerGlance(controller)
    before, desk.glance = desk.glance, glance.at_rest
    try:
        with desk.following(glance.on_the_way):
            yield
    finally:
        desk.glance = before
