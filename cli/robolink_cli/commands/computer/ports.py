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
    """List the serial ports, and whether you may use them. Opens none."""
    from dataclasses import asdict

    from robolink_cli.commands.computer.serial_ports import serial_ports

    found = serial_ports()
    if json_is_on():
        emit_json("robolink/ports/1", {"ports": [asdict(port) for port in found]})
    else:
        _show(found)


def _show(found: "list[SerialPort]") -> None:
    if not found:
        say(tr("No serial port was found."))
        return
    for port in found:
        say("  ".join(filter(None, (port.device, port.description, port.hardware))))
        if not port.usable:
            say(tr("    you may not use it; 'robolink doctor' says what to do"))
