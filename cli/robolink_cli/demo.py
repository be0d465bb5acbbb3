"""demo: a whole nozzle change on a simulated robot, over a real socket."""

import click

from robolink_cli._context import json_option


@click.command()
@click.option("--seed", type=int, default=1, show_default=True, help="Another cell, another tip.")
@click.option(
    "--speed",
    type=click.FloatRange(1, 100),
    default=20.0,
    show_default=True,
    help="How many times faster than real the simulated time passes.",
)
@json_option
def demo(seed: int, speed: float) -> None:
    """Change the nozzle of a simulated EPSON SCARA and recalibrate its tool.

    Everything crosses a TCP connection on this machine's loopback. No robot is touched.
    """
    from robolink_cli._demonstration import demonstrate

    demonstrate(seed=seed, speed=speed)
