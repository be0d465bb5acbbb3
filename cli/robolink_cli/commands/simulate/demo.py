"""demo: a whole nozzle change on each kind of simulated controller."""

import click

from robolink_cli.console.numbers import NumberInside
from robolink_cli.options.shared import json_option


@click.command()
@click.option(
    "--seed", type=int, metavar="N", default=1, show_default=True, help="Another cell, another tip."
)
@click.option(
    "--speed",
    type=NumberInside(1, 100),
    metavar="FACTOR",
    default=20.0,
    show_default=True,
    help="How many times faster than real the simulated time passes.",
)
@click.option(
    "--operator",
    type=click.Choice(["careful", "careless"]),
    default="careful",
    show_default=True,
    help="Who touches the pin; a careless person only presses Enter, and must not be believed.",
)
@json_option
def demo(seed: int, speed: float, operator: str) -> None:
    """Change the nozzle of a simulated EPSON SCARA, then of a simulated SoftMotion PLC.

    The SCARA is reached over a TCP connection on this machine's loopback, the PLC through its
    mailbox inside this process. No machine is touched.
    """
    from robolink_cli.commands.simulate.demonstration import DemoOperator, demonstrate

    demonstrate(seed=seed, speed=speed, operator=DemoOperator(operator))
