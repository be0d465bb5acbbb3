"""status, where, stop, reset, motors: read the state of a controller, and stop it."""

from typing import TYPE_CHECKING, Annotated, Literal

import click

from robolink.errors import DeclinedError, JournalError, LeaseHeldError
from robolink.messages import tr
from robolink.model import Act
from robolink.transport import parse_url
from robolink_cli.access.capabilities import preferences_of, require_epson, require_softmotion
from robolink_cli.access.warnings import note_unsettled
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, note, say, show_requests
from robolink_cli.console.shell_words import state_word
from robolink_cli.options.consent import DryRun, Yes
from robolink_cli.options.declaration import CliArgument
from robolink_cli.options.shared import shared_options
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.questions import agree
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import (
    CliContext,
    calming_options,
    controller_options,
    looking_options,
    stop_request,
)
from robolink_cli.session.motion_consent import agree_to_motion
from robolink_cli.stopping.notes import (
    clear_noted_stop,
    forget_stop,
    may_move_again,
    note_document,
    noted_stop,
    own_name_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robolink.controllers import SoftMotionController
    from robolink.model import Controller, Marker

_PLC = "softmotion"
"""The kind of controller on which a stop holds the axis group until it is released."""


@click.command()
@looking_options
def status(context: CliContext) -> None:
    """Show what the controller is doing. Reads only; allowed while production runs.

    While another robolink on this computer uses a controller that serves only one client, this
    shows who that is, and the last state that it read.
    """
    from robolink_cli.session.motion_consent import note_doubts
    from robolink_cli.session.stop_listener import seen_by_another
    from robolink_cli.views.documents import show_seen, show_status, status_payload

    named = context.expected.cell if context.expected else context.require_url()
    beside = seen_by_another(context.require_url())
    if beside is not None:
        emit("status-beside", beside, lambda: show_seen(beside, named))
        return
    with open_controller(context, looks=True) as controller:
        payload = status_payload(controller)
        note_doubts(payload, controller, context.expected)
    emit("status", payload, lambda: show_status(payload))


@click.command()
@looking_options
def where(context: CliContext) -> None:
    """Show the measured position of the selected tool, and the joints."""
    from robolink_cli.views.documents import pose_payload, show_pose

    with open_controller(context, looks=True) as controller:
        group = controller.groups[0]
        pose, axes = group.pose(), group.axes()
    payload = pose_payload(pose) | {name: list(values) for name, values in axes.items()}
    emit("where", payload, lambda: show_pose(payload))


@click.command()
@shared_options
def stop(
    *,
    dry_run: DryRun = False,
) -> None:
    """Stop the robot from any terminal, whatever is moving it. Not an emergency stop.

    It asks nothing and waits for no file. Afterwards every command that moves asks first, until
    you run 'robolink robot reset' or 'robolink robot release'.
    """
    from robolink_cli.stopping.outcome import Telling, requests_of
    from robolink_cli.stopping.stop_first import stop_first

    request = stop_request()
    if dry_run:
        show_requests(requests_of(request))
        return
    outcome = stop_first(request)
    telling = Telling(request, outcome)
    telling.explain_the_holder()
    if outcome.error is None:
        emit("stop", telling.payload(), lambda: say(telling.sentence()))
    for remark in telling.remarks():
        note(remark)
    if outcome.error is not None:
        raise outcome.error


@click.command()
@calming_options
def release(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Allow movement again after a stop: shows who stopped the robot and when, and asks.

    On a PLC it releases the axis group that the stop holds. It clears no error: 'reset' does.
    """
    url = context.require_url()
    found = noted_stop(url)
    if parse_url(url).kind == _PLC:
        held, state = _released_plc(context, noted=found is not None, dry_run=dry_run, yes=yes)
    else:
        held, state = False, ""
        if found is not None and not dry_run:
            agree(may_move_again(), yes=yes)
    if dry_run:
        if not held:
            show_requests(())
        return
    if found is not None:
        clear_noted_stop(url, found)
    payload: dict[str, object] = {"released": held or found is not None, "hold_released": held}
    emit("release", payload | {"note": note_document(found)}, lambda: _say_released(payload, state))


def _released_plc(
    context: CliContext, *, noted: bool, dry_run: bool, yes: bool
) -> tuple[bool, str]:
    """Release what a stop holds on a PLC; return whether it held, and the state afterwards."""
    with open_controller(context, calms=True, quiet=True) as controller:
        plc = require_softmotion(controller)
        held = plc.condition()["held_by_a_stop"] is True
        if dry_run:
            if held:
                show_requests(plc.preview(Act.RESET))
            return held, ""
        with plc.latch.calming(tr("release of the stop")):
            if held:
                note(tr("A stop holds the axis group of the PLC. Releasing it moves nothing."))
            if held or noted:
                agree(may_move_again(), yes=yes)
            held = held and plc.release_hold()
        if (desk := current_desk()) is not None:
            desk.look()  # else its last screen shows the controller as it was before
        return held, plc.status().state


def _say_released(payload: "Mapping[str, object]", state: str) -> None:
    if not payload["released"]:
        say(tr("No stop is on record here; there is nothing to release."))
        return
    if state in ("", "ready"):
        say(tr("Released: commands may move the robot again."))
        return
    say(
        tr(
            "The stop is released. The controller's state is: {state}.",
            state=state_word(state),
        )
    )


@click.command()
@calming_options
def reset(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Clear an error. May switch outputs off: a gripper may drop its part."""
    with open_controller(context, calms=True, quiet=True) as controller:
        if dry_run:
            show_requests(controller.preview(Act.RESET))
            return
        effect, told = _effect_of_reset(controller)
        if told and (yes or not person_here()):
            note(effect)  # there is no question, so the effect is shown before it is sent
        with controller.latch.calming(str(Act.RESET)):
            agree(tr("{effect} Reset now?", effect=effect), yes=yes)
            controller.reset_fault()
        state = controller.status().state
        name = own_name_of(controller)
        left = _left_open(controller)
        named = context.expected.cell if context.expected else context.require_url()
        # After the reset, because an interrupted job can be finished or undone from now on.
        note_unsettled(controller, left, named)
    forget_stop(context.require_url(), name)
    payload: dict[str, object] = {"state": state}
    emit(
        "reset",
        payload,
        lambda: say(tr("Reset done. The controller's state is: {state}.", state=state_word(state))),
    )


def _left_open(controller: "Controller") -> "tuple[Marker, ...]":
    """Return the unfinished jobs; a damaged journal is reported at the end."""
    try:
        return controller.outcomes.open_markers()
    except JournalError:
        return ()


def _effect_of_reset(controller: "Controller") -> tuple[str, bool]:
    """Return what a reset does to the outputs, and whether the controller reported that."""
    from robolink.protocols.epson_text import Preference

    told = preferences_of(controller)
    if told is None:
        return tr("Reset can switch outputs off: a part may drop."), False
    if Preference.RESET_OUTPUTS_OFF in told:
        return tr("Reset SWITCHES THE OUTPUTS OFF (vacuum, gripper): a part may drop."), True
    return tr("Reset clears the error; the outputs stay as they are."), True


@click.command()
@calming_options
def motors(
    context: CliContext,
    *,
    switch: Annotated[Literal["on", "off"], CliArgument()],
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Switch the robot's motors on or off, and confirm it."""
    on = switch == "on"
    with open_controller(context, calms=not on) as controller:
        if dry_run:
            show_requests(controller.preview(Act.MOTORS_ON if on else Act.MOTORS_OFF))
            return
        if on:
            agree(tr("Switch the motors on? Nobody may be in the cell."), yes=yes)
        controller.motors(on)
    payload: dict[str, object] = {"motors_on": on}
    emit(
        "motors",
        payload,
        lambda: say(tr("The motors are {switch}.", switch=tr("on") if on else tr("off"))),
    )


@click.command()
@controller_options
def enable(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Enable the axis group of a PLC, and confirm it; the PLC's own program switches the drives."""
    _switch_group(context, on=True, dry_run=dry_run, yes=yes)


@click.command()
@controller_options
def disable(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Disable the axis group of a PLC, which must not be moving, and confirm it."""
    _switch_group(context, on=False, dry_run=dry_run, yes=yes)


def _switch_group(context: CliContext, *, on: bool, dry_run: bool, yes: bool) -> None:
    with open_controller(context) as controller:
        require_softmotion(controller)
        if dry_run:
            show_requests(controller.preview(Act.MOTORS_ON if on else Act.MOTORS_OFF))
            return
        if on:
            agree(tr("Enable the axis group? Nobody may be at the machine."), yes=yes)
        controller.motors(on)
    payload: dict[str, object] = {"enabled": on}
    state = tr("enabled") if on else tr("disabled")
    emit("group", payload, lambda: say(tr("The axis group is {state}.", state=state)))


@click.command("execute-raw")
@controller_options
def execute_raw(
    context: CliContext,
    *,
    statement: Annotated[str, CliArgument()],
    yes: Yes = False,
) -> None:
    """Run one SPEL+ statement as typed; for engineers. It is recorded.

    robolink sends it once, unchanged, and needs the answer within --timeout. Do not use it for
    movements: robolink may not be able to confirm how they ended.
    """
    with open_controller(context, changes=True) as controller:
        agree_to_motion(
            tr("Send {statement!r} as typed? It may do anything.", statement=statement),
            yes=yes,
            in_tool=False,
        )
        printed = require_epson(controller, tr("SPEL+ statements")).execute_raw(statement)
    payload: dict[str, object] = {"statement": statement, "printed": printed}
    emit("execute-raw", payload, lambda: say(printed or tr("carried out")))


@click.command("take-ownership")
@controller_options
def take_ownership(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Take a PLC's mailbox from the client that has it locked; afterwards it is free.

    For a program that hangs or that nobody can find. The PLC stops that client's movement within
    half a second, and refuses its commands from then on.
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
            tr("No other client had the mailbox locked. It is free.")
            if held is None
            else tr("The mailbox was taken from client {holder}, and is free now.", holder=held)
        ),
    )


def _holder(plc: "SoftMotionController") -> str | None:
    """Ask for the mailbox as everybody does; return who has it, ``None`` if it was given."""
    try:
        plc.take()
    except LeaseHeldError as error:
        return error.holder
    return None


def _ask(plc: "SoftMotionController", holder: str, *, yes: bool) -> None:
    """Let a person insist.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    if not yes and not person_here():
        raise DeclinedError(
            tr(
                "Client {holder} has the mailbox of {controller} locked, and there is "
                "nobody to ask.",
                holder=holder,
                controller=plc.identity,
            ),
            remedy=tr("End that program, or take over: run this on a terminal, or add --yes."),
            controller=plc.identity,
        )
    if plc.status().running:
        question = tr(
            "Client {holder} has the mailbox locked, and the axis group moves: the PLC "
            "will stop it. Take over the mailbox? Only if you can see the cell.",
            holder=holder,
        )
    else:
        question = tr(
            "Client {holder} has the mailbox locked. Take it over? Only if you can see the cell.",
            holder=holder,
        )
    agree(question, yes=yes)


def _record(plc: "SoftMotionController", holder: str) -> None:
    from robolink.model import EntryKind, NewEntry

    verdict = tr("the mailbox was taken from client {holder}", holder=holder)
    plc.outcomes.append(
        NewEntry(EntryKind.DECISION, verdict=verdict, details={"taken_from": holder})
    )
