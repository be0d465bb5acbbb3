"""Offering, on a terminal, to put the cell's own tool back before anything else is done."""

from collections.abc import Iterable
from contextlib import suppress

from robolink.errors import ControllerError
from robolink.messages import tr
from robolink.model import Controller, Marker, MarkerKind
from robolink_cli.console.render import json_is_on, note
from robolink_cli.prompts.questions import asked, on_terminal


def offer_to_restore(controller: Controller, markers: Iterable[Marker]) -> None:
    """Ask whether a tool that an unfinished procedure left selected is to be changed back.

    A no changes nothing and the command goes on. Nothing is asked of a script, nor where the
    controller is not in a state to be told anything.
    """
    if json_is_on() or not on_terminal():
        return
    for marker in markers:
        if marker.kind is not MarkerKind.SELECTION:
            continue
        with suppress(ControllerError):
            finding = controller.resolver.examine(marker)
            if finding.action and asked(tr("Do it now: {action}?", action=finding.action)):
                controller.resolver.settle(finding)
                note(tr("Done, and read back."))
