"""calibrate METHOD: measure a tool offset, propose it, write it, prove it.

Every method runs in one frame (``_frame``): plan and limits, consent, measurement, proposal with
interval and verdict, question, write, proof, report. A method only says how it measures.
"""

from typing import Final

import click

from robolink.messages import tr
from robolink_cli._lazy import LazyGroup

METHODS: Final = {
    "two-pose": (
        "robolink_cli.calibrate.two_pose:two_pose",
        tr("Touch one pin at two angles of U, half a turn apart."),
    ),
}
"""Name, where it is, one-line help; in the order of the help page."""


@click.group(
    cls=LazyGroup,
    lazy=METHODS,
    help=tr("Measure where a tool's tip is, propose the offset, write it and prove it."),
)
def calibrate() -> None:
    """Root of the methods."""
