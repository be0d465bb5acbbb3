"""Serial lines: which cells name one, and who answers at a given line."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.errors import ConfigError, ConnectError, TransportError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.controllers.epson.verify import LineProbe

_WIRED = ("serial", "modbus-rtu")


@dataclass(frozen=True, slots=True)
class SerialPort:
    """One port, as the operating system describes it.

    Attributes:
        device: Its name, for example ``/dev/ttyUSB0`` or ``COM3``.
        description: What it is, for people.
        hardware: USB vendor and product, or empty.
        group: The group that may use it; empty when that is unknown, as on Windows.
        usable: Whether this user may read and write it.
    """

    device: str
    description: str
    hardware: str
    group: str
    usable: bool


def serial_ports() -> list[SerialPort]:
    """Return the ports in the order of their names. None is opened."""
    from serial.tools import list_ports

    return [
        SerialPort(
            port.device,
            port.description if port.description != "n/a" else "",
            port.hwid if port.hwid != "n/a" else "",
            _group_of(port.device),
            # Windows has no access rights on ports.
            os.name != "posix" or os.access(port.device, os.R_OK | os.W_OK),
        )
        for port in sorted(list_ports.comports())
    ]


def ports_unknown(error: str) -> str:
    """Return the sentence for a system that did not list its ports."""
    return tr("The serial ports of this computer could not be listed ({error}).", error=error)


def _group_of(device: str) -> str:
    try:
        import grp

        return grp.getgrgid(os.stat(device).st_gid).gr_name
    except (ImportError, OSError, KeyError):
        return ""


@dataclass(frozen=True, slots=True)
class AskedLine:
    """A line that was asked, or could not be.

    Attributes:
        url: As it was given.
        probe: What was found; ``None`` when it could not be opened.
        why: Why not.
    """

    url: str
    probe: "LineProbe | None"
    why: str = ""


def devices_of_cells() -> dict[str, list[str]]:
    """Return the cells of each serial port in the cell files, by the port.

    Files that are wrong name none: ``doctor`` tells what is wrong with them.
    """
    from robolink.config import load_cells
    from robolink.transport import parse_url

    try:
        cells = load_cells()
    except ConfigError:
        return {}
    named: dict[str, list[str]] = {}
    for cell in cells.values():
        link = parse_url(cell.url)
        if link.medium in _WIRED and link.port is None:
            named.setdefault(link.path or link.host.upper(), []).append(cell.name)
    return named


def ask_lines(urls: Sequence[str], timeout_s: float) -> list[AskedLine]:
    """Ask at each line who is there.

    Raises:
        ConfigError: A URL makes no sense; then none was opened.
    """
    from robolink.controllers.epson.verify import probe_line, require_line
    from robolink.transport import parse_url

    for url in urls:
        require_line(parse_url(url))
    asked = list[AskedLine]()
    for url in urls:
        try:
            asked.append(AskedLine(url, probe_line(url, timeout_s=max(timeout_s, 0.5))))
        except (ConnectError, TransportError) as error:
            asked.append(AskedLine(url, None, error.what))
    return asked


def show_lines(asked: Sequence[AskedLine]) -> None:
    """Show what was found at each line, and every byte that was sent."""
    from robolink.controllers.epson.verify import AtTheLine
    from robolink_cli.console.render import say  # doctor lists ports even without click

    found = {
        AtTheLine.CONTROLLER: tr("an EPSON controller answers by Remote RS232"),
        AtTheLine.OTHER: tr("something answers, but it is not Remote RS232 with these settings"),
        AtTheLine.TALKING: tr("something sends there unasked; robolink sent nothing"),
        AtTheLine.NOBODY: tr("no answer"),
    }
    for line in asked:
        if line.probe is None:
            say(f"{line.url}: {line.why}")
            continue
        say(f"{line.url}: {found[line.probe.found]}")
        say(
            tr(
                "    sent: {sent}; received: {received}",
                sent=_hex(line.probe.sent),
                received=_hex(line.probe.received),
            )
        )


def as_json(line: AskedLine) -> dict[str, object]:
    """Return a line for ``--json``."""
    if line.probe is None:
        return {"url": line.url, "found": "unusable", "why": line.why}
    return {
        "url": line.url,
        "found": line.probe.found,
        "sent": line.probe.sent.hex(" "),
        "received": line.probe.received.hex(" "),
    }


def _hex(data: bytes) -> str:
    return data.hex(" ") or tr("nothing")
