"""robot, cell, expert: groups whose commands live in the families.

Beside them ``config``, the group of before, whose commands are part of ``cell`` now.
"""

from typing import Final

import click

from robolink.messages import declared
from robolink_cli.command_map import COMPANIONS, COMPUTER, CONTROLLER, MEASURE, SHIPPED
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.shared import shared_options

_ROBOT: Final = {
    "where": (
        f"{CONTROLLER}.operate:where",
        declared("Where the robot is, and with which tool."),
    ),
    "jog": (f"{CONTROLLER}.jog:jog", declared("Move a small step, in Power Low.")),
    "motors": (
        f"{CONTROLLER}.operate:motors",
        declared("Switch the motors, or the axis group of a PLC, on or off."),
    ),
    "reset": (f"{CONTROLLER}.operate:reset", declared("Clear an error of the controller.")),
    "release": (
        f"{CONTROLLER}.operate:release",
        declared("Let the robot be moved again after a stop."),
    ),
    "io": (f"{CONTROLLER}.io:io", declared("Read inputs, switch outputs and memory bits.")),
    "variable": (f"{CONTROLLER}.var:var", declared("Read and set the project's variables.")),
    "take-ownership": (
        f"{CONTROLLER}.operate:take_ownership",
        declared("Take a PLC's mailbox from another client, because a person insists."),
    ),
}

_CELL: Final = {
    "list": (f"{COMPUTER}.config:list_cells", declared("The cells that have a name here.")),
    "new": (
        f"{COMPUTER}.config:new_cell",
        declared("Write a new cell into a cell file; asks what it needs."),
    ),
    "show": (f"{COMPUTER}.config:show", declared("All settings that count for one cell.")),
    "tools": (
        f"{MEASURE}.cell_tools:cell_tools",
        declared("All tools of a cell: value, last change, age, and what is due."),
    ),
    "check": (
        f"{COMPUTER}.cell_check:check",
        declared(
            "Whether cells are in order and nothing is due; for a nightly job, moves nothing."
        ),
    ),
    "files": (f"{COMPUTER}.config:path", declared("Which cell files are looked at.")),
    "validate": (f"{COMPUTER}.config:check", declared("Whether the cell files are right.")),
    "doctor": (
        f"{COMPUTER}.doctor:doctor",
        declared("What could go wrong on this computer."),
    ),
    "scan": (f"{COMPUTER}.scan:scan", declared("Try which of a few addresses answer.")),
    "ports": (f"{COMPUTER}.ports:ports", declared("List the serial ports.")),
    "people": (f"{COMPUTER}.config:people", declared("Who works at a cell, and in which role.")),
    "station": (
        f"{MEASURE}.station:station",
        declared("Pins, beams, surfaces and cameras of a cell: where, and how well known."),
    ),
    "accuracy": (
        f"{MEASURE}.accuracy:accuracy",
        declared("What a cell knows of its accuracy, and the command that measures each row."),
    ),
}

_EXPERT: Final = {
    "serve": (
        f"{COMPANIONS}.serve:serve",
        declared("Answer programs that calibrate a tool themselves."),
    ),
    "spel": (
        f"{COMPANIONS}.spel:spel",
        declared("SPEL+ programs: check them, run them, write the companions."),
    ),
    "plc": (
        f"{COMPANIONS}.plc:plc",
        declared("The register map and data types of a PLC's mailbox."),
    ),
    "verify-controller": (
        f"{CONTROLLER}.verify_controller:verify_controller",
        declared("Find out, reading only, what this controller really does."),
    ),
    "check-contract": (
        f"{CONTROLLER}.check_contract:check_contract",
        declared("Hold a controller, reading only, to what every kind promises."),
    ),
    "execute-raw": (
        f"{CONTROLLER}.operate:execute_raw",
        declared("Run one SPEL+ statement as typed; for engineers."),
    ),
    "solve": (
        f"{MEASURE}.solve.command:solve",
        declared("Calculate a tool offset from a file, offline."),
    ),
    "poses": (
        f"{MEASURE}.poses:poses",
        declared("What robolink understands of a file of poses."),
    ),
    "docs": (f"{SHIPPED}.docs:docs", declared("Read the pages of the documentation.")),
    "recipe": (
        f"{SHIPPED}.recipe:recipe",
        declared("Copy a recipe to begin with; check your own."),
    ),
    "completion": (
        f"{COMPUTER}.completion:completion",
        declared("Make TAB complete commands."),
    ),
}

_CONFIG: Final = {
    "path": (f"{COMPUTER}.config:path", "cell files"),
    "check": (f"{COMPUTER}.config:check", "cell validate"),
    "show": (f"{COMPUTER}.config:show", "cell show"),
}

robot = LazyGroup(
    name="robot",
    lazy=_ROBOT,
    help=declared("Look at the robot, move it a little, reset it."),
)

cell = LazyGroup(
    name="cell",
    lazy=_CELL,
    help=declared("The cells of this computer: their files, their stations, and what is wrong."),
)


@click.group(
    cls=LazyGroup,
    lazy=_EXPERT,
    help=declared(
        "What integrators and engineers need besides.\n\n"
        "The options stand before or after the name of any command."
    ),
)
@shared_options
def expert() -> None:
    """Root of the rest; its page shows the options that all commands share."""


config = LazyGroup(
    name="config", lazy={}, renamed=_CONFIG, help=declared("Look at the cell files.")
)
"""The group of before; what it held is named in ``cell``."""
