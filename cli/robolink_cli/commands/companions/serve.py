"""serve: programs that measure and write a tool themselves ask here whether it may stay."""

from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.console.render import note
from robolink_cli.session.context import json_option

if TYPE_CHECKING:
    from robolink.serving import CallbackConversation, CallbackServer


@click.command("serve")
@click.option(
    "--spel",
    "address",
    required=True,
    metavar="HOST:PORT",
    help="Where SPEL+ programs call, for example 127.0.0.1:5001.",
)
@click.option(
    "--allow",
    multiple=True,
    metavar="ADDRESS",
    help="Address of a controller that may call; needed for any HOST but this computer's own. "
    "May be repeated.",
)
@click.option(
    "--controller",
    "controllers",
    multiple=True,
    metavar="NAME",
    help="Name under which a robot is on record; by default epson: and its serial number. For a "
    "controller with several robots repeat it: each name ends in the robot's serial number.",
)
@click.option(
    "--tolerance-mm",
    type=float,
    default=0.1,
    show_default=True,
    help="Largest drift about the new tip, and widest interval.",
)
@click.option(
    "--max-change-mm",
    type=float,
    default=2.0,
    show_default=True,
    help="Largest change of the offset that is believed.",
)
@click.option("--sigma-mm", type=float, help="How far one touch scatters, where it is known.")
@json_option
def serve(
    *,
    address: str,
    allow: tuple[str, ...],
    controllers: tuple[str, ...],
    tolerance_mm: float,
    max_change_mm: float,
    sigma_mm: float | None,
) -> None:
    """Answer running programs that calibrate a tool at their own safe point.

    The program moves and writes; here it is decided whether the value is proved, and all is
    put on record. Nothing is sent to a controller. docs/spel-callback.md shows both sides.
    """
    from robolink import __version__
    from robolink.journal import open_journal, signature_here
    from robolink.serving import CallbackConversation, CallbackLimits, CallbackServer
    from robolink_cli.commands.simulate.serving import Termination, host_and_port

    host, port = host_and_port(address, "--spel")
    limits = CallbackLimits(tolerance_mm, max_change_mm, sigma_mm)
    journal, signature = open_journal(), signature_here(__version__)

    def conversation(peer: str) -> "CallbackConversation":
        return CallbackConversation(
            journal, limits, peer=peer, signature=signature, controllers=controllers
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
    """Say where it listens, at once, because whoever started it waits for that."""
    import json

    from robolink_cli.console.output import hand_over, show
    from robolink_cli.console.render import json_is_on

    host, port = server.address
    if json_is_on():
        hand_over(json.dumps({"schema": "robolink/serve/1", "host": host, "port": port}))
    else:
        show(tr("Programs may call at {host}:{port}. Ctrl-C ends it.", host=host, port=port))
