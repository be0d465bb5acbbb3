"""status, where, stop, reset, motors, resolve: looking at a controller and calming it."""

import click

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_cli._consent import agree, dry_run_option, yes_option
from robolink_cli._context import CliContext, controller_options, open_controller
from robolink_cli._render import say


@click.command()
@controller_options
def status(context: CliContext) -> None:
    """Show what the controller is doing. Reads only; legal while production runs."""
    from robolink_cli._tables import show_status
    from robolink_cli._views import status_payload

    with open_controller(context) as controller:
        payload = status_payload(controller)
    context.emit("status", payload, lambda: show_status(payload))


@click.command()
@controller_options
def where(context: CliContext) -> None:
    """Show where the tool in force is (measured), and the joints."""
    from robolink_cli._tables import show_pose
    from robolink_cli._views import pose_payload

    with open_controller(context) as controller:
        group = controller.groups[0]
        pose, printed = group.pose(), group.joints()
    payload = pose_payload(pose)
    payload |= {"joints": list(printed.joints), "pulses": list(printed.pulses)}
    context.emit("where", payload, lambda: show_pose(payload))


@click.command()
@controller_options
@dry_run_option
def stop(context: CliContext, dry_run: bool) -> None:
    """Stop the controller's tasks. Not an emergency stop, and no substitute for one."""
    try:
        # Whatever robot it is: a stop does not wait for a look at the model.
        with open_controller(context, any_robot=True) as controller:
            if dry_run:
                context.show_requests([controller.wire("Stop")])
                return
            controller.stop()
            state = controller.status().state
    except ConnectError as error:
        error.remedy = f"{tr('To stop the robot now, press the emergency stop.')} {error.remedy}"
        raise
    payload: dict[str, object] = {"stopped": True, "state": state}
    context.emit(
        "stop",
        payload,
        lambda: say(tr("Stop was accepted; the controller is: {state}.", state=state)),
    )


@click.command()
@controller_options
@dry_run_option
@yes_option
def reset(context: CliContext, dry_run: bool, yes: bool) -> None:
    """Clear an error. May switch outputs off: a gripper may drop its part."""
    with open_controller(context) as controller:
        if dry_run:
            context.show_requests([controller.wire("Reset")])
            return
        agree(
            tr("Reset may switch outputs off (vacuum, gripper). Go on?"),
            yes=yes,
        )
        controller.reset_fault()
        state = controller.status().state
    payload: dict[str, object] = {"state": state}
    context.emit(
        "reset",
        payload,
        lambda: say(tr("The reset was carried out; the controller is: {state}.", state=state)),
    )


@click.command()
@click.argument("switch", type=click.Choice(["on", "off"]))
@controller_options
@dry_run_option
@yes_option
def motors(context: CliContext, switch: str, dry_run: bool, yes: bool) -> None:
    """Switch the robot's motors on or off, and prove it."""
    on = switch == "on"
    with open_controller(context) as controller:
        if dry_run:
            name = "SetMotorsOn" if on else "SetMotorsOff"
            robot = controller.robot_number()
            context.show_requests([controller.wire(name, str(robot))])
            return
        if on:
            agree(tr("Is the cell clear? The motors go on."), yes=yes)
        controller.motors(on)
    payload: dict[str, object] = {"motors_on": on}
    context.emit("motors", payload, lambda: say(tr("The motors are {switch}.", switch=switch)))


@click.command()
@controller_options
@dry_run_option
@yes_option
@click.option(
    "--forget",
    is_flag=True,
    help="Forget everything unsettled on your word, without looking or restoring.",
)
def resolve(context: CliContext, dry_run: bool, yes: bool, forget: bool) -> None:
    """Settle what an earlier run left in doubt: look, say what is true, restore the tool.

    Nothing that moved or was written is sent again.
    """
    from robolink_cli._resolve import resolve_all

    with open_controller(context, quiet=True) as controller:
        payload = resolve_all(controller, dry_run=dry_run, yes=yes, forget=forget)
    context.emit("resolve", payload, lambda: None)
