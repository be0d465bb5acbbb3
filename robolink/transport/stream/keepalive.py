"""How a connection whose far end lost its power is noticed, also while nothing is asked.

Such a peer answers nothing, and bytes sent to it "succeed" for minutes unless the kernel is told
otherwise (docs/reference/faults.md F11). The kernel probes after 1 s of silence and 1 s later, and
gives the connection up with its third tick, after 3 s and a little. Who waits on the connection
need not wait for that tick: two probes without an answer are enough.
"""

import errno
import os
import socket
import struct
from typing import Final

# Unacknowledged data end the connection after 2.5 s. Each constant is missing on some platform.
_OPTIONS: Final = (
    ("SOL_SOCKET", "SO_KEEPALIVE", 1),
    ("IPPROTO_TCP", "TCP_NODELAY", 1),
    ("IPPROTO_TCP", "TCP_KEEPIDLE", 1),
    ("IPPROTO_TCP", "TCP_KEEPINTVL", 1),
    ("IPPROTO_TCP", "TCP_KEEPCNT", 2),
    ("IPPROTO_TCP", "TCP_USER_TIMEOUT", 2500),
)

_PROBES: Final = 2
_SILENT_MS: Final = 2500
_INFO: Final = struct.Struct("@8B13I")
"""The beginning of ``struct tcp_info`` of linux/tcp.h, up to ``tcpi_last_ack_recv``."""
_PROBES_OUT, _LAST_DATA, _LAST_ACK = 3, 19, 20


def set_keepalive(connection: socket.socket) -> None:
    """Have the kernel probe a silent far end, and give up one that acknowledges nothing."""
    for level, name, value in _OPTIONS:
        if hasattr(socket, name):
            connection.setsockopt(getattr(socket, level), getattr(socket, name), value)


def unheard(connection: socket.socket) -> OSError | None:
    """Return that the far end is gone: two probes unanswered, and silent for 2.5 s.

    ``None`` while it is there, and where the system does not tell (all but Linux): the kernel's own
    3 s hold then.
    """
    if not hasattr(socket, "TCP_INFO"):
        return None
    try:
        info = _INFO.unpack(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _INFO.size))
    except (OSError, struct.error):
        return None  # closed meanwhile; the next call says so
    if info[_PROBES_OUT] < _PROBES or min(info[_LAST_DATA], info[_LAST_ACK]) < _SILENT_MS:
        return None
    return TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT))
