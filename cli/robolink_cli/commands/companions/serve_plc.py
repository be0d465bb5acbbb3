"""Answers the program of a PLC, call after call, until somebody ends it."""

from typing import TYPE_CHECKING

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.serving import PermitCall, free_machine
from robolink_cli.commands.companions.serve_events import ServeEvents
from robolink_cli.commands.simulate.serving import Termination
from robolink_cli.session.context import CliContext
from robolink_cli.session.opening import open_controller

if TYPE_CHECKING:
    from robolink.model import ToolOffset
    from robolink.serving import CallbackLimits, PermitPlan


def serve_plc(context: CliContext, plan: "PermitPlan", limits: "CallbackLimits") -> None:
    """Answer calls. Each has a session of its own: its end gives the mailbox back.

    Raises:
        RobolinkError: The PLC is not reached, or a write is in doubt: the machine stays blocked.
    """
    events = ServeEvents()
    with Termination() as termination:
        with open_controller(context, changes=True) as controller:
            free_machine(controller)
            where = controller.identity
        events.tell(
            "listening", tr("The program of {where} may call. Ctrl-C ends it.", where=where)
        )
        while not termination.came:
            try:
                with open_controller(
                    context, changes=True, usual_change_mm=limits.max_change_mm
                ) as controller:
                    call = PermitCall(
                        controller,
                        plan,
                        limits,
                        ended=lambda: termination.came,
                        cell=context.cell,
                    )
                    kept = call.answer()
            except CalibrationError as error:
                events.refused(str(error), error.code, error)
            else:
                if kept is not None:
                    _tell_kept(events, plan.tool, kept)


def _tell_kept(events: ServeEvents, tool: int, kept: "ToolOffset") -> None:
    sentence = tr(
        "Tool {tool} was tested and kept: X {x:.3f} Y {y:.3f} Z {z:.3f}.",
        tool=tool,
        x=kept.x_mm,
        y=kept.y_mm,
        z=kept.z_mm,
    )
    events.tell("kept", sentence, tool=tool, x_mm=kept.x_mm, y_mm=kept.y_mm, z_mm=kept.z_mm)
