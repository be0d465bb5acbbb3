"""scan RANGE: where a controller might be: addresses that answer, and serial lines."""

import ipaddress
import socket
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option


@click.command()
@json_option
def scan(
    *,
    addresses: Annotated[str | None, CliArgument(metavar="[RANGE]")] = None,
    port: Annotated[
        int,
        click.IntRange(1, 65535),
        CliOption(help="TCP port to try; 5000 is that of EPSON Remote Ethernet."),
    ] = 5000,
    timeout_s: Annotated[
        float,
        NumberInside(min=0.05, max=10),
        CliOption(help="Longest wait for one address, in seconds."),
    ] = 0.5,
    lines: Annotated[
        tuple[str, ...],
        CliOption(
            "--line",
            metavar="URL",
            help="Find what answers on this serial line, for example "
            "epson+serial:///dev/ttyUSB0?baud=38400. May be repeated.",
        ),
    ] = (),
) -> None:
    """Find which addresses of RANGE accept a TCP connection, at most 256 of them.

    RANGE is 192.168.0.7, 192.168.0.1-20 or 192.168.0.0/28. robolink closes each connection at once
    and sends nothing. A controller serves one client at a time and its maker does not say what a
    second connection does to the first: scan while nobody is connected. The serial ports of this
    computer are listed too; only those of --line are opened.

    robolink listens to a line first. If it is silent, robolink sends 04 and 02 53 03 50: turn
    Remote RS232 on, and report the status. That changes and moves nothing on an EPSON controller;
    do not name a line with a device that these five bytes could harm.
    """
    from robolink_cli.commands.computer.checkup import tried
    from robolink_cli.commands.computer.lines import (
        as_json,
        ask_lines,
        ports_unknown,
        serial_ports,
        show_lines,
    )

    if addresses is None and not lines:
        raise click.UsageError(
            tr("A range of addresses, or a serial line with --line, is missing.")
        )
    wanted = [] if addresses is None else parse_range(addresses)
    asked = ask_lines(lines, timeout_s)
    probes = probe_all(wanted, port, timeout_s) if wanted else []
    answering = [f"epson+tcp://{p.address}:{port}" for p in probes if p.state is State.OPEN]
    problems: list[str] = []
    serial = [found.device for found in tried(serial_ports, ports_unknown, problems) or []]
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
            "lines": [as_json(line) for line in asked],
            "problems": problems,
        }
        emit_json("robolink/scan/1", document)
        return
    show_lines(asked)
    if wanted:
        _show(probes, port, timeout_s, answering)
    for problem in problems:
        say(problem)
    if not problems:
        say(tr("serial ports of this computer: {ports}", ports=", ".join(serial) or tr("none")))


def _show(
    probes: "Sequence[AddressProbe]", port: int, timeout_s: float, answering: list[str]
) -> None:

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
        say(tr("An open port need not be a controller; to check: robolink -c URL status"))


MOST: Final = 256
"""Most addresses in one scan. A longer one would search a foreign network."""

_AT_ONCE: Final = 32


class State(StrEnum):
    """What an address did."""

    OPEN = "open"
    REFUSED = "refused"
    SILENT = "silent"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, slots=True)
class AddressProbe:
    """One address, what it did and how long that took."""

    address: str
    state: State
    elapsed_ms: float


def parse_range(text: str) -> list[str]:
    """Return the addresses of ``A``, ``A-LAST``, ``A-B`` or ``A/PREFIX``, all IPv4.

    Raises:
        ConfigError: It is none of these, or more than 256.
    """
    try:
        first, last = _ends(text)
    except ValueError as error:
        raise ConfigError(
            tr("{text!r} is not a range of addresses.", text=text),
            remedy=tr("Write 192.168.0.7, 192.168.0.1-20 or 192.168.0.0/28."),
        ) from error
    count = last - first + 1
    if not 1 <= count <= MOST:
        raise ConfigError(
            tr("{text!r} stands for {count} addresses.", text=text, count=max(count, 0)),
            remedy=tr("Give 1 to {most} addresses, lowest first.", most=MOST),
        )
    return [str(ipaddress.IPv4Address(number)) for number in range(first, last + 1)]


def probe_all(addresses: Sequence[str], port: int, timeout_s: float) -> list[AddressProbe]:
    """Connect to each address and close again; nothing is sent. In the order given."""
    workers = ThreadPoolExecutor(min(_AT_ONCE, len(addresses)), thread_name_prefix="scan")
    try:
        return list(workers.map(lambda address: _probe(address, port, timeout_s), addresses))
    finally:
        # Ctrl-C waits only for the connections in progress, not for the whole range.
        workers.shutdown(cancel_futures=True)


def _ends(text: str) -> tuple[int, int]:
    if "/" in text:
        network = ipaddress.IPv4Network(text, strict=False)
        return int(network.network_address), int(network.broadcast_address)
    start, dash, end = text.partition("-")
    first = ipaddress.IPv4Address(start)
    if not dash:
        return int(first), int(first)
    if "." not in end:
        end = f"{start.rpartition('.')[0]}.{end}"
    return int(first), int(ipaddress.IPv4Address(end))


def _probe(address: str, port: int, timeout_s: float) -> AddressProbe:
    begun = time.perf_counter()
    try:
        socket.create_connection((address, port), timeout=timeout_s).close()
        state = State.OPEN
    except TimeoutError:
        state = State.SILENT
    except ConnectionRefusedError:
        state = State.REFUSED
    except OSError:
        state = State.UNREACHABLE
    return AddressProbe(address, state, round((time.perf_counter() - begun) * 1000, 1))
