"""Signs of life for what restarts an agent: systemd, and whatever keeps to its protocol.

A datagram goes to the socket that the environment names
(https://www.freedesktop.org/software/systemd/man/latest/sd_notify.html).
"""

import os
import socket

__all__ = ["UNIT", "notify"]

UNIT = """\
[Unit]
Description=robolink: the agent of plant {plant}
After=network-online.target
Wants=network-online.target

[Service]
Type=notify
User={user}
WorkingDirectory={folder}
{environment}ExecStart={command}
WatchdogSec=60
TimeoutStopSec=90
Restart=always
RestartSec=2

[Install]
WantedBy=multi-user.target
"""
"""A unit of systemd: it starts an agent anew that has ended, or gave no sign of life for 60 s.

It works as the user who asked for it, in that folder: with the same cell files and journal.
"""


def notify(state: str) -> bool:
    """Tell the service manager how this process is; return whether there is one.

    Args:
        state: ``READY=1``, ``WATCHDOG=1`` or ``STOPPING=1``.

    Example:
        >>> from robolink.fleet.watchdog import notify
        >>> notify("WATCHDOG=1")  # nobody started this process as a service
        False
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address or not hasattr(socket, "AF_UNIX"):
        return False
    if address.startswith("@"):  # in Linux' abstract name space
        address = f"\0{address[1:]}"
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as link:
            link.sendto(state.encode(), address)
    except OSError:
        return False  # the manager is being restarted: the next sign of life reaches it
    return True
