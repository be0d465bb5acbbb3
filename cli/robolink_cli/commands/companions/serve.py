"""serve: answers programs that measure and write a tool themselves."""

import json
from typing import TYPE_CHECKING, Annotated, Literal

import click

from robolink.errors import CalibrationError, RobolinkError
from robolink.messages import tr
from robolink.serving import PermitCall, free_machine
from robolink_cli.commands.simulate.service import Termination
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on, note
from robolink_cli.options.declaration import CliOption
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, optional_controller

if TYPE_CHECKING:
    from robolink.model import ToolOffset
    from robolink.serving import CallbackLimits, CallbackServer, PermitPlan


@click.command("serve")
@optional_controller
def serve(
    context: CliContext,
    *,
    address: Annotated[
        str | None,
        CliOption(
            "--spel",
            metavar="HOST:PORT",
            help="Where SPEL+ programs connect, for example 127.0.0.1:5001. With -c CELL, "
            "the stations are those of that cell.",
        ),
    ] = None,
    method: Annotated[
        Literal["n-angle", "pivot"] | None,
        CliOption(
            "--plc",
            help="Serve the program of the PLC named with -c: it touches a pin, by this "
            "method. docs/plc-callback.md",
        ),
    ] = None,
    allow: Annotated[
        tuple[str, ...],
        CliOption(
            metavar="ADDRESS",
            help="Address of a controller that may connect; needed unless HOST is this "
            "computer's own. May be repeated.",
        ),
    ] = (),
    controllers: Annotated[
        tuple[str, ...],
        CliOption(
            "--on-record",
            metavar="NAME",
            help="Name under which a robot is recorded; default: epson: and its serial number. "
            "For a controller with several robots repeat it: each name ends in the "
            "robot's serial number.",
        ),
    ] = (),
    tolerance_mm: Annotated[
        float,
        NumberInside(min=0, min_open=True),
        CliOption(
            "--tolerance-mm",
            help="Largest drift of the new tip in the turn test, and widest interval.",
        ),
    ] = 0.1,
    max_change_mm: Annotated[
        float,
        NumberInside(min=0, min_open=True),
        CliOption("--max-change-mm", help="Largest change of the offset that is accepted."),
    ] = 2.0,
    sigma_mm: Annotated[
        float | None,
        NumberInside(min=0, min_open=True),
        CliOption("--sigma-mm", help="Scatter of one touch, if known."),
    ] = None,
    tool: Annotated[
        int | None,
        click.IntRange(1, 15),
        CliOption(help="With a PLC: the slot that its program measures."),
    ] = None,
    touches: Annotated[int, CliOption(help="With a PLC: touches before the write.")] = 5,
    proofs: Annotated[int, CliOption(help="With a PLC: touches afterwards.")] = 2,
    permit_is_contact: Annotated[
        bool,
        CliOption(
            help="With a PLC: while it calibrates, it gives its permit only when tip and pin touch."
        ),
    ] = False,
) -> None:
    """Let running programs calibrate a tool at their own safe point.

    The program moves the robot; robolink calculates and tests the value, and keeps the record. A
    SPEL+ program writes the value itself, and robolink sends nothing to its controller
    (docs/spel-callback.md). For a PLC, robolink writes the value into its slot
    (docs/plc-callback.md).
    """
    from robolink.serving import CallbackLimits

    if context.cell is not None:  # nobody is there to accept larger limits
        allowed_mm = context.cell.limits(usual_mm=max_change_mm).length_mm
        max_change_mm = min(max_change_mm, allowed_mm or max_change_mm)
    limits = CallbackLimits(tolerance_mm, max_change_mm, sigma_mm)
    if (address is None) is (method is None):
        raise click.UsageError(tr("expert serve takes one of --spel and --plc."))
    if address is not None:
        _serve_programs(context, address, limits, allow=allow, controllers=controllers)
        return
    if tool is None or not permit_is_contact:
        raise click.UsageError(
            tr("--plc needs --tool, and --permit-is-contact: without it nothing shows a touch.")
        )
    from robolink.serving import PermitPlan

    plan = PermitPlan(tool, str(method), touches, proofs)
    serve_plc(context, plan, limits)


def _serve_programs(
    context: CliContext,
    address: str,
    limits: "CallbackLimits",
    *,
    allow: tuple[str, ...],
    controllers: tuple[str, ...],
) -> None:
    from robolink import __version__
    from robolink.journal import open_journal, signature_here
    from robolink.serving import CallbackConversation, CallbackServer
    from robolink_cli.commands.simulate.service import host_and_port

    if context.cell is not None:
        context.cell.home.require_here()  # before anybody can connect
    host, port = host_and_port(address, "--spel")
    journal, signature = open_journal(), signature_here(__version__)
    events = ServeEvents()

    def conversation(peer: str) -> CallbackConversation:
        def tell(code: str, error: "RobolinkError") -> None:
            sentence = tr(
                "{peer} gets the answer {code}: {cause}", peer=peer, code=code, cause=error
            )
            events.refused(sentence, code, error, peer=peer)

        return CallbackConversation(
            journal,
            limits,
            peer=peer,
            signature=signature,
            controllers=controllers,
            cell=context.cell,
            tell=tell,
        )

    server = CallbackServer(host, port, conversation, allow=allow, tell=note)
    try:
        with Termination() as termination:
            server.start()
            _announce(server)
            termination.wait()
    finally:
        server.close()


def _announce(server: "CallbackServer") -> None:
    """Show where it listens, at once, because whoever started it waits for that."""
    import json

    host, port = server.address
    if json_is_on():
        hand_over(json.dumps({"schema": "robolink/serve/1", "host": host, "port": port}))
    else:
        show(
            tr(
                "Programs can connect to {host}:{port}. Ctrl-C ends the service.",
                host=host,
                port=port,
            )
        )


class ServeEvents:
    """Reports each event at once: a line of JSON for a script, a sentence for a person.

    It is made in the thread of the command, which alone knows whether JSON was asked for.
    """

    def __init__(self) -> None:
        self._json = json_is_on()

    def tell(self, event: str, sentence: str, **payload: object) -> None:
        """Report an event; ``sentence`` may be empty if a person was already told."""
        if self._json:
            hand_over(json.dumps({"schema": "robolink/serve-event/1", "event": event, **payload}))
        elif sentence:
            show(sentence)

    def refused(self, sentence: str, code: str, error: RobolinkError, **payload: object) -> None:
        """Report a refusal: a person reads what to do, a script also gets the code."""
        note(sentence)
        self.tell("refused", "", code=code, what=error.what, remedy=error.remedy, **payload)


def serve_plc(context: CliContext, plan: "PermitPlan", limits: "CallbackLimits") -> None:
    """Answer calls. Each has its own session, whose end releases the mailbox.

    Raises:
        RobolinkError: The PLC is not reached, or a write is in doubt: the machine stays blocked.
    """
    events = ServeEvents()
    with Termination() as termination:
        with open_controller(context, changes=True) as controller:
            free_machine(controller)
            where = controller.identity
        events.tell(
            "listening",
            tr("The program of {where} can connect. Ctrl-C ends the service.", where=where),
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
