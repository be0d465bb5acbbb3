"""The error of a simulator that cannot listen gives the reason, alike at each kind of port."""

import errno
import os
import re
import socket

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.errors import ConnectError

SERVERS = {
    "control": lambda host, port: ControlServer({}, (host, port)),
    "epson": lambda host, port: serve_tcp(
        EpsonSimulator(), host=host, port=port, clock=ScaledClock()
    ),
    "modbus": lambda host, port: serve_modbus_tcp(SoftMotionSimulator(), host=host, port=port),
}


@pytest.mark.parametrize("serve", SERVERS.values(), ids=SERVERS)
def test_a_port_that_is_taken_is_told_once_and_why(serve):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConnectError) as told:
            serve("127.0.0.1", port)
    reason = os.strerror(errno.EADDRINUSE) if os.name == "posix" else "[^:(]+"
    form = rf"The simulator cannot listen on 127\.0\.0\.1 port {port}: {reason}\."
    assert re.fullmatch(form, told.value.what)
    assert "another port" in told.value.remedy


@pytest.mark.parametrize("serve", SERVERS.values(), ids=SERVERS)
def test_a_port_that_there_is_not_is_told_too(serve):
    with pytest.raises(ConnectError, match=r"port 70000: .+"):
        serve("127.0.0.1", 70000)
