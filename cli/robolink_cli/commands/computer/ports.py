"""ports: the serial ports of this computer."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from robolink_cli.commands.computer.lines import SerialPort


@click.command()
@json_option
def ports() -> int:
    """List the serial ports, the cells on them, and whether you may use them. Opens none.

    Exit code 1 when the system or a cell file could not be read; the rest is shown.
    """
    from robolink_cli.commands.computer.checkup import tried
    from robolink_cli.commands.computer.lines import devices_of_cells, ports_unknown, serial_ports

    problems: list[str] = []
    found = tried(serial_ports, ports_unknown, problems) or []
    cells = tried(devices_of_cells, _cells_unknown, problems) or {}
    if json_is_on():
        entries = [{**asdict(port), "cells": cells.get(port.device, [])} for port in found]
        emit_json("robolink/ports/1", {"ports": entries, "problems": problems})
    else:
        for problem in problems:
            say(problem)
        if found or not problems:
            _show(found, cells)
    return DIFFERENT if problems else 0


def _cells_unknown(error: str) -> str:
    return tr("The cells on serial ports could not be read ({error}).", error=error)


def _show(found: "list[SerialPort]", cells: dict[str, list[str]]) -> None:
    if not found:
        say(tr("No serial port was found."))
        return
    for port in found:
        say("  ".join(filter(None, (port.device, port.description, port.hardware))))
        if names := cells.get(port.device):
            say(tr("    cells: {names}", names=", ".join(names)))
        if not port.usable:
            say(tr("    no permission to use it; 'robolink cell doctor' says what to do"))
