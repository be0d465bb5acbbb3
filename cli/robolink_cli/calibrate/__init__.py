"""calibrate METHOD: measure a tool offset, propose it, write it, prove it.

Every method runs in one frame (``_frame``): plan and limits, consent, measurement, proposal with
interval and verdict, question, write, proof, report. A method only says how it measures.
"""

from typing import Final

import click

from robolink.messages import tr
from robolink_cli.lazy_group import LazyGroup

METHODS: Final = {
    "two-pose": (
        "robolink_cli.calibrate.two_pose:two_pose",
        tr("Touch one pin at two angles of U, half a turn apart."),
    ),
    "n-angle": (
        "robolink_cli.calibrate.n_angle:n_angle",
        tr("Touch one pin at several angles of U; the touches check each other."),
    ),
    "one-touch": (
        "robolink_cli.calibrate.one_touch:one_touch",
        tr("Touch a known pin once: X, Y and Z, for a change of the needle."),
    ),
    "beams": (
        "robolink_cli.calibrate.beams:beams",
        tr("Drive the tip through two crossed light beams: X and Y."),
    ),
    "z-touch": (
        "robolink_cli.calibrate.z_touch:z_touch",
        tr("Touch a surface that switches an input: Z."),
    ),
    "camera": (
        "robolink_cli.calibrate.camera:camera",
        tr("See the tip with a calibrated, up-looking camera: X and Y."),
    ),
    "camera-affine": (
        "robolink_cli.calibrate.camera_affine:camera_affine",
        tr("Find an up-looking camera and the tip together."),
    ),
    "board": (
        "robolink_cli.calibrate.board:board",
        tr("See the fiducials of a held board: X, Y and U."),
    ),
    "pivot": (
        "robolink_cli.calibrate.pivot:pivot",
        tr("Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six."),
    ),
    "six-point": (
        "robolink_cli.calibrate.six_point:six_point",
        tr("A pivot and two ways along the tool's axes: all six components."),
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
