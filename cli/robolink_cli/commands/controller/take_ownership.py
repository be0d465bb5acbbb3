"""take-ownership: a person at the cell takes a PLC's mailbox from a client that holds it."""

from typing import TYPE_CHECKING

import click

from robolink.errors import DeclinedError, LeaseHeldError
from robolink.messages import tr
from robolink_cli.access.capabilities import require_softmotion
from robolink_cli.console.render import emit, say, show_requests
from robolink_cli.options.consent import DryRun, Yes
from robolink_cli.prompts.questions import agree, on_terminal
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.controllers import SoftMotionController


@click.command("take-ownership")
@controller_options
def take_ownership(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Take a PLC's mailbox from the client that holds it; nobody has it afterwards.

    For a program that hangs or that nobody finds. What that client has under way is halted by
    the PLC within half a second, and it is refused from then on.
    """
    with open_controller(context, changes=not dry_run) as controller:
        plc = require_softmotion(controller)
        if dry_run:
            show_requests((plc.preview_take(insist=True),))
            return
        held = _holder(plc)
        if held is not None:
            _ask(plc, held, yes=yes)
            _record(plc, held)
            plc.take(insist=True)
    payload: dict[str, object] = {"taken_from": held}
    emit(
        "ownership",
        payload,
        lambda: say(
            tr("Nobody else held the mailbox. It is free.")
            if held is None
            else tr("The mailbox was taken from client {holder}, and is free now.", holder=held)
        ),
    )


def _holder(plc: "SoftMotionController") -> str | None:
    """Ask for the mailbox as everybody does; return who holds it, ``None`` when it was given."""
    try:
        plc.take()
    except LeaseHeldError as error:
        return error.holder
    return None


def _ask(plc: "SoftMotionController", holder: str, *, yes: bool) -> None:
    """Have a person insist.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    if not yes and not on_terminal():
        raise DeclinedError(
            tr(
                "Client {holder} holds the mailbox of {controller}, but there is nobody to ask.",
                holder=holder,
                controller=plc.identity,
            ),
            remedy=tr(
                "End that program; 10 s after its last sign the mailbox is free. To insist all the "
                "same, run it on a terminal, or give --yes."
            ),
            controller=plc.identity,
        )
    if plc.status().running:
        question = tr(
            "Client {holder} holds the mailbox, and the axis group moves: the PLC will halt "
            "it. Take the mailbox away? Only if you see the cell.",
            holder=holder,
        )
    else:
        question = tr(
            "Client {holder} holds the mailbox. Take it away? Only if you see the cell.",
            holder=holder,
        )
    agree(question, yes=yes)


def _record(plc: "SoftMotionController", holder: str) -> None:
    from robolink.model import EntryKind, NewEntry

    verdict = tr("the mailbox was taken from client {holder}", holder=holder)
    plc.outcomes.append(
        NewEntry(EntryKind.DECISION, verdict=verdict, details={"taken_from": holder})
    )
