"""scan RANGE: where a controller might be: addresses that answer, and serial ports."""

import click

from robolink.messages import tr
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.session.context import json_option


@click.command()
@click.argument("addresses", metavar="RANGE")
@click.option("--port", type=click.IntRange(1, 65535), default=5000, show_default=True)
@click.option(
    "--timeout",
    "timeout_s",
    type=click.FloatRange(min=0.05, max=10),
    default=0.5,
    show_default=True,
    metavar="S",
    help="Longest wait for one address, in seconds.",
)
@json_option
def scan(addresses: str, port: int, timeout_s: float) -> None:
    """Try which addresses of RANGE accept a TCP connection, at most 256 of them.

    RANGE is 192.168.0.7, 192.168.0.1-20 or 192.168.0.0/28. Each connection is closed at once
    and nothing is sent. A controller serves one client at a time and its maker does not say
    what a second connection does to the first: scan while nobody is connected. The serial
    ports of this computer are listed beside; none is opened.
    """
    from robolink_cli.commands.computer.scanning import State, parse_range, probe_all
    from robolink_cli.commands.computer.serial_ports import serial_ports

    wanted = parse_range(addresses)
    probes = probe_all(wanted, port, timeout_s)
    answering = [f"epson+tcp://{p.address}:{port}" for p in probes if p.state is State.OPEN]
    serial = [found.device for found in serial_ports()]
    if json_is_on():
        entries = [
            {"address": p.address, "state": p.state, "elapsed_ms": p.elapsed_ms} for p in probes
        ]
        document = {
            "port": port,
            "timeout_s": timeout_s,
            "urls": answering,
            "probes": entries,
            "serial_ports": serial,
        }
        emit_json("robolink/scan/1", document)
        return
    for url in answering:
        say(url)
    counted = {state: sum(p.state is state for p in probes) for state in State}
    say(
        tr(
            "port {port}: {open} of {count} addresses accepted a connection, {refused} refused, "
            "{silent} did not answer within {timeout:g} s, {failed} could not be reached.",
            port=port,
            count=len(probes),
            open=counted[State.OPEN],
            refused=counted[State.REFUSED],
            silent=counted[State.SILENT],
            failed=counted[State.UNREACHABLE],
            timeout=timeout_s,
        )
    )
    if answering:
        say(tr("An open port is no proof of a controller: 'robolink -c URL status' asks it."))
    say(tr("serial ports of this computer: {ports}", ports=", ".join(serial) or tr("none")))
