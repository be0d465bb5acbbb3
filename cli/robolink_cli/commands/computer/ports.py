"""ports: the serial ports of this computer."""

from typing import TYPE_CHECKING

import click

from robolink.messages import tr
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.session.context import json_option

if TYPE_CHECKING:
    from robolink_cli.commands.computer.serial_ports import SerialPort


@click.command()
@json_option
def ports() -> None:
    """List the serial ports, the cells on them, and whether you may use them. Opens none."""
    from dataclasses import asdict

    from robolink_cli.commands.computer.lines import devices_of_cells
    from robolink_cli.commands.computer.serial_ports import serial_ports

    found, cells = serial_ports(), devices_of_cells()
    if json_is_on():
        entries = [{**asdict(port), "cells": cells.get(port.device, [])} for port in found]
        emit_json("robolink/ports/1", {"ports": entries})
    else:
        _show(found, cells)


def _show(found: "list[SerialPort]", cells: dict[str, list[str]]) -> None:
    if not found:
        say(tr("No serial port was found."))
        return
    for port in found:
        say("  ".join(filter(None, (port.device, port.description, port.hardware))))
        if names := cells.get(port.device):
            say(tr("    cells: {names}", names=", ".join(names)))
        if not port.usable:
            say(tr("    you may not use it; 'robolink cell doctor' says what to do"))
