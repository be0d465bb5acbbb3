"""The open ports of robolink and its simulators, their permitted clients, and password secrecy.

Rows F71, F73 and F74 of the catalogue.
"""

import ipaddress
import os
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator, serve_plc
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import JournalError
from robolink.journal import open_journal
from robolink.register_maps import load_map
from robolink.stopping import StopListener

Addresses = set[tuple[str, int]]

MAP = Path("examples/plc-maps/level-handshake.toml")


def listening() -> Addresses:
    """Return the addresses on which this process accepts connections or datagrams."""
    mine = {os.readlink(path) for path in map(fd, os.listdir("/proc/self/fd")) if path.is_symlink()}
    found = set()
    for table, wanted in (("tcp", "0A"), ("tcp6", "0A"), ("udp", "07"), ("udp6", "07")):
        path = Path(f"/proc/net/{table}")
        for line in path.read_text().splitlines()[1:] if path.exists() else ():
            fields = line.split()
            if fields[3] == wanted and f"socket:[{fields[9]}]" in mine:
                address, _, port = fields[1].partition(":")
                found.add((readable(address), int(port, 16)))
    return found


def fd(name: str) -> Path:
    return Path("/proc/self/fd", name)


def readable(address: str) -> str:
    """Return an address of /proc/net, whose words are in the machine's byte order."""
    words = bytes.fromhex(address)
    turned = b"".join(words[i : i + 4][::-1] for i in range(0, len(words), 4))
    return str(ipaddress.ip_address(turned))


@contextmanager
def everything_served() -> Iterator[
    tuple[EpsonSimulator, SoftMotionSimulator, set[tuple[str, int]]]
]:
    """Open every port that robolink and its simulators can open; yield the new ones."""
    before = listening()
    epson, plc, clock = EpsonSimulator(seed=2), SoftMotionSimulator(seed=2), ScaledClock()
    with ExitStack() as stack:
        url = stack.enter_context(serve_tcp(epson, clock=clock)).url
        stack.enter_context(serve_assist(epson, clock=clock))
        stack.enter_context(ControlServer({"epson": ControlledCell(epson, clock)}))
        stack.enter_context(serve_modbus_tcp(plc, clock=clock))
        stack.enter_context(serve_plc(PlcSimulator(load_map(MAP), seed=2), MAP, clock=clock))
        controller = stack.enter_context(robolink.connect(url))
        stack.enter_context(StopListener(controller, url))
        yield epson, plc, listening() - before


@pytest.fixture
def no_local_sockets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make stops arrive on a port, as with a path that is too long, and on Windows."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / ("long" * 30)))


@pytest.mark.fault("F73")
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="there is no /proc/net here")
@pytest.mark.usefixtures("no_local_sockets")
def test_f73_every_port_that_is_opened_is_one_of_this_computer_alone():
    with everything_served() as (_, _, opened):
        assert len(opened) == 6
        assert {address for address, _ in opened} == {"127.0.0.1"}


PAGES = (
    b"POST / HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n"
    b"Content-Type: text/plain\r\nContent-Length: 400\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: null\r\nUpgrade: websocket\r\n\r\n",
    b"POST /guessed/v1/cells/epson/press_estop HTTP/1.1\r\nHost: localhost\r\n"
    b"Origin: http://evil.example\r\nContent-Length: 0\r\n\r\n",
)
BODY = (
    b'{"do": "press_estop"}\n$Login,\r\n$Execute,"TLSet 1, XY(1,2,3,0)"\r\n$SetMotorsOn,1\r\n'
    b'{"token": "", "do": "press_estop"}\n{"stop": true}\n'
)


@pytest.mark.fault("F74")
@pytest.mark.parametrize("page", PAGES, ids=["post", "websocket", "guessed token"])
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="there is no /proc/net here")
@pytest.mark.usefixtures("no_local_sockets")
def test_f74_a_page_of_somebody_else_gets_nothing_done_at_any_port(page):
    with everything_served() as (epson, plc, opened):
        tools, started = epson.machine.tools.defined(), plc.plc.group.movements_started
        web = 0
        for address, port in opened:
            with socket.create_connection((address, port), timeout=5) as browser:
                browser.sendall(page + BODY)
                browser.shutdown(socket.SHUT_WR)
                browser.settimeout(0.3)
                heard = b""
                try:
                    while piece := browser.recv(4096):
                        heard += piece
                except (TimeoutError, ConnectionResetError):
                    pass
                web += b"HTTP" in heard
                assert set(re.findall(rb"HTTP/1\.1 (\d)", heard)) <= {b"4"}
        assert web == 1  # the control API, and it refuses
        assert not epson.condition.estop_pressed
        assert epson.machine.tools.defined() == tools
        assert plc.plc.group.movements_started == started


@pytest.mark.fault("F71")
def test_f71_the_password_of_a_journal_s_server_stands_in_no_error():
    with socket.socket() as taken:  # bound and not listening
        taken.bind(("127.0.0.1", 0))
        place = f"127.0.0.1:{taken.getsockname()[1]}/robolink"
        for url in (
            f"postgresql://ann:canary-secret@{place}",
            f"postgresql+psycopg://ann@{place}?password=canary-secret",
        ):
            with pytest.raises(JournalError) as caught:
                open_journal(url)
            told, cause = [str(caught.value)], caught.value.__cause__
            while cause is not None:
                told.append(str(cause))
                cause = cause.__cause__
            assert "cannot be reached" in told[0]
            assert not [text for text in told if "canary-secret" in text]
