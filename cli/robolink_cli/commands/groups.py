"""robot, cell, expert: groups whose commands live in the families.

Beside them ``config``, the former group, whose commands are part of ``cell`` now.
"""

from typing import Final

import click

from robolink.messages import declared
from robolink_cli.command_map import (
    COMPANIONS,
    COMPUTER,
    CONTROLLER,
    FLEET,
    MEASURE,
    SHIPPED,
    SIMULATE,
)
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.shared import shared_options

_ROBOT: Final = {
    "where": (
        f"{CONTROLLER}.operate:where",
        declared("Show where the robot is, and with which tool."),
    ),
    "jog": (f"{CONTROLLER}.jog:jog", declared("Move a small step, in Power Low.")),
    "motors": (
        f"{CONTROLLER}.operate:motors",
        declared("Switch the motors, or the axis group of a PLC, on or off."),
    ),
    "reset": (f"{CONTROLLER}.operate:reset", declared("Clear an error of the controller.")),
    "release": (
        f"{CONTROLLER}.operate:release",
        declared("Allow movement again after a stop."),
    ),
    "io": (f"{CONTROLLER}.io:io", declared("Read inputs, switch outputs and memory bits.")),
    "variable": (f"{CONTROLLER}.var:var", declared("Read and set the project's variables.")),
    "take-ownership": (
        f"{CONTROLLER}.operate:take_ownership",
        declared("Take over a PLC's mailbox that another client has locked."),
    ),
}

_CELL: Final = {
    "list": (f"{COMPUTER}.config:list_cells", declared("List the cells of the cell files.")),
    "new": (
        f"{COMPUTER}.config:new_cell",
        declared("Add a cell to a cell file; asks for what it needs."),
    ),
    "show": (f"{COMPUTER}.config:show", declared("Show all settings of one cell.")),
    "tools": (
        f"{MEASURE}.cell_tools:cell_tools",
        declared("Show all tools of a cell: value, last change, age, and what is due."),
    ),
    "check": (
        f"{COMPUTER}.cell_check:check",
        declared("Nightly check: unexpected changes, overdue checks. Moves nothing."),
    ),
    "fleet": (
        f"{FLEET}.command:fleet",
        declared("Plans for many cells: plan status halt resume permit"),
    ),
    "files": (f"{COMPUTER}.config:path", declared("Show which cell files robolink reads.")),
    "validate": (f"{COMPUTER}.config:check", declared("Check the cell files.")),
    "doctor": (
        f"{COMPUTER}.doctor:doctor",
        declared("Check this computer's setup."),
    ),
    "scan": (f"{COMPUTER}.scan:scan", declared("Find which of a few addresses answer.")),
    "ports": (f"{COMPUTER}.ports:ports", declared("List the serial ports.")),
    "people": (
        f"{COMPUTER}.config:people",
        declared("Show who works at a cell, and in which role."),
    ),
    "trust": (
        f"{COMPUTER}.certificates:trust",
        declared("Compare the certificate of a PLC's OPC UA server, and keep it."),
    ),
    "certificate": (
        f"{COMPUTER}.certificates:certificate",
        declared("Show or renew this computer's certificate for OPC UA."),
    ),
    "station": (
        f"{MEASURE}.station:station",
        declared(
            "Show the pins, beams, surfaces and cameras of a cell: where, and how accurately known."
        ),
    ),
    "eye": (
        f"{MEASURE}.eye:eye",
        declared(
            "See what robolink finds in a camera's picture; collect pictures for tests. Moves "
            "nothing."
        ),
    ),
    "accuracy": (
        f"{MEASURE}.accuracy:accuracy",
        declared(
            "Show what is known of a cell's accuracy, and the command that measures each row."
        ),
    ),
}

_EXPERT: Final = {
    "serve": (
        f"{COMPANIONS}.serve:serve",
        declared("Serve robot programs that start a calibration themselves."),
    ),
    "spel": (
        f"{COMPANIONS}.spel:spel",
        declared("SPEL+ programs: check them, run them, write the companions."),
    ),
    "plc": (
        f"{COMPANIONS}.plc:plc",
        declared("Export the register map and data types of a PLC's mailbox."),
    ),
    "verify-controller": (
        f"{CONTROLLER}.verify_controller:verify_controller",
        declared("Find out how this controller really behaves. Reads only."),
    ),
    "check-contract": (
        f"{CONTROLLER}.check_contract:check_contract",
        declared("Check that a controller behaves as every type must. Reads only."),
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
        declared("Show how robolink reads a file of poses."),
    ),
    "docs": (f"{SHIPPED}.docs:docs", declared("Read the pages of the documentation.")),
    "recipe": (
        f"{SHIPPED}.recipe:recipe",
        declared("Copy a recipe to start from; check your own."),
    ),
    "completion": (
        f"{COMPUTER}.completion:completion",
        declared("Set up TAB completion."),
    ),
    "demo": (
        f"{SIMULATE}.demo:demo",
        declared("A whole needle change on a simulated robot; needs no machine."),
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
        "More commands, for integrators and engineers.\n\n"
        "You can put the options before or after the name of any command."
    ),
)
@shared_options
def expert() -> None:
    """Root of the rest; its page shows the options that all commands share."""


config = LazyGroup(
    name="config", lazy={}, renamed=_CONFIG, help=declared("Look at the cell files.")
)
"""The former group. The names of its commands refer to ``cell``."""
