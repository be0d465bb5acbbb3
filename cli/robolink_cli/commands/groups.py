"""robot, cell, expert: groups whose commands live in the families.

Beside them ``config``, the group of before, whose commands are part of ``cell`` now.
"""

from typing import Final

import click

from robolink.messages import tr
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.shared import shared_options

_CONTROLLER: Final = "robolink_cli.commands.controller"
_COMPUTER: Final = "robolink_cli.commands.computer"
_COMPANIONS: Final = "robolink_cli.commands.companions"
_MEASURE: Final = "robolink_cli.commands.measure"

_ROBOT: Final = {
    "where": (
        f"{_CONTROLLER}.operate:where",
        tr("Where the robot is, and with which tool."),
    ),
    "jog": (f"{_CONTROLLER}.jog:jog", tr("Move a small step, in Power Low.")),
    "motors": (
        f"{_CONTROLLER}.operate:motors",
        tr("Switch the motors, or the axis group of a PLC, on or off."),
    ),
    "reset": (f"{_CONTROLLER}.operate:reset", tr("Clear an error of the controller.")),
    "release": (
        f"{_CONTROLLER}.operate:release",
        tr("Let the robot be moved again after a stop."),
    ),
    "io": (f"{_CONTROLLER}.io:io", tr("Read inputs, switch outputs and memory bits.")),
    "variable": (f"{_CONTROLLER}.var:var", tr("Read and set the project's variables.")),
    "take-ownership": (
        f"{_CONTROLLER}.take_ownership:take_ownership",
        tr("Take a PLC's mailbox from another client, because a person insists."),
    ),
}

_CELL: Final = {
    "list": (f"{_COMPUTER}.config:list_cells", tr("The cells that have a name here.")),
    "show": (f"{_COMPUTER}.config:show", tr("All that is in force for one cell.")),
    "files": (f"{_COMPUTER}.config:path", tr("Which cell files are looked at.")),
    "validate": (f"{_COMPUTER}.config:check", tr("Whether the cell files are right.")),
    "doctor": (
        f"{_COMPUTER}.doctor:doctor",
        tr("What could get in the way on this computer."),
    ),
    "scan": (f"{_COMPUTER}.scan:scan", tr("Try which of a few addresses answer.")),
    "ports": (f"{_COMPUTER}.ports:ports", tr("List the serial ports.")),
    "people": (f"{_COMPUTER}.config:people", tr("Who works at a cell, and in which role.")),
    "station": (
        f"{_MEASURE}.station:station",
        tr("Pins, beams, surfaces and cameras of a cell: where they are, and how sure."),
    ),
}

_EXPERT: Final = {
    "serve": (
        f"{_COMPANIONS}.serve:serve",
        tr("Answer programs that calibrate a tool themselves."),
    ),
    "spel": (
        f"{_COMPANIONS}.spel:spel",
        tr("SPEL+ programs: check them, run them, write the companions."),
    ),
    "plc": (
        f"{_COMPANIONS}.plc:plc",
        tr("The register map and data types of a PLC's mailbox."),
    ),
    "verify-controller": (
        f"{_CONTROLLER}.verify_controller:verify_controller",
        tr("Find out, reading only, what this controller really does."),
    ),
    "execute-raw": (
        f"{_CONTROLLER}.operate:execute_raw",
        tr("Run one SPEL+ statement as typed; for engineers."),
    ),
    "solve": (
        f"{_MEASURE}.solve.command:solve",
        tr("Calculate a tool offset from a file, offline."),
    ),
    "poses": (
        f"{_MEASURE}.poses:poses",
        tr("What robolink understands of a file of poses."),
    ),
    "completion": (
        f"{_COMPUTER}.completion:completion",
        tr("Make TAB complete commands."),
    ),
}

_CONFIG: Final = {
    "path": (f"{_COMPUTER}.config:path", "cell files"),
    "check": (f"{_COMPUTER}.config:check", "cell validate"),
    "show": (f"{_COMPUTER}.config:show", "cell show"),
}

robot = LazyGroup(
    name="robot",
    lazy=_ROBOT,
    help=tr("Look at the robot, move it a little, and calm it."),
)

cell = LazyGroup(
    name="cell",
    lazy=_CELL,
    help=tr("The cells of this computer: their files, their places, and what is in the way."),
)


@click.group(
    cls=LazyGroup,
    lazy=_EXPERT,
    help=tr(
        "What integrators and engineers need besides.\n\n"
        "The options stand before or after the name of any command."
    ),
)
@shared_options
def expert() -> None:
    """Root of the rest; its page shows the options that all commands share."""


config = LazyGroup(name="config", lazy={}, renamed=_CONFIG, help=tr("Look at the cell files."))
"""The group of before; what it held is named in ``cell``."""
