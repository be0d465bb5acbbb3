"""The serial ports of this computer, and whether this user may open them."""

import os
from dataclasses import dataclass

from robolink.messages import tr


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
            # Windows keeps no rights on ports.
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
