"""A far end that never stops sending is told so, after little of it was read.

The figure that is asserted is what this process held at most (tracemalloc), not what the
kernel buffered: the far end offers up to 64 MB and would go on.
"""

import contextlib
import socket
import threading
import time
import tracemalloc
from collections.abc import Iterator

import can
import pytest

import robolink
from robolink.errors import (
    ConnectError,
    RemoteProtocolError,
    RobolinkError,
    TransportTimeoutError,
)
from robolink.transport import open_modbus, parse_url
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from tests.unit._scripted_can import IDENTITY, NODE, SDO_ANSWER, FakeClock, ScriptedBus, node_with

OFFERED = 64_000_000
HELD = 2_000_000
"""Bytes; the codec's own limit for a message is 65536, and texts are copied a few times."""

SOON_S = 5.0

FLOODS = {
    "no line end": b"x" * 4096,
    "no end of a quoted text": b'#Execute,"' + b"a\r\n" * 1300,
    "answers": b"#GetStatus,00100000001,0000\r\n" * 100,
    "empty lines": b"\r\n" * 2000,
}


@pytest.fixture(scope="module", autouse=True)
def _everything_is_imported(tmp_path_factory):
    """Do what is done once before it is measured what a flood costs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(tmp_path_factory.mktemp("state")))
        robolink.connect("epson+sim://flood-warm").close()
        with contextlib.suppress(ConnectError):
            open_modbus(parse_url("softmotion+modbus-tcp://127.0.0.1:1"), timeout_s=0.3)


@contextlib.contextmanager
def flooding(greeting: bytes, flood: bytes) -> Iterator[int]:
    """Serve one client on a port: answer its first bytes, then send without an end."""

    def serve() -> None:
        client, _ = listener.accept()
        with client, contextlib.suppress(OSError):
            client.recv(4096)
            client.sendall(greeting)
            for _ in range(OFFERED // len(flood)):
                client.sendall(flood)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        thread.join(timeout=SOON_S)
        assert not thread.is_alive(), "the client still takes what is sent"


@contextlib.contextmanager
def little_is_held() -> Iterator[None]:
    tracemalloc.start()
    began_s = time.monotonic()
    try:
        yield
        assert time.monotonic() - began_s < SOON_S
        assert tracemalloc.get_traced_memory()[1] < HELD
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("flood", FLOODS)
def test_an_epson_controller_that_floods_is_named_and_left(flood):
    with flooding(b"#Login,0\r\n", FLOODS[flood]) as port, little_is_held():
        controller = None
        with pytest.raises(RobolinkError) as caught:
            controller = robolink.connect(f"epson+tcp://127.0.0.1:{port}", timeout_s=1.0)
            time.sleep(0.05)  # what comes now was asked by nobody
            controller.status()
        if controller is not None:
            controller.close()
    assert isinstance(caught.value, RemoteProtocolError)
    assert caught.value.remedy
    assert len(str(caught.value)) < 1000


def test_a_modbus_server_that_floods_costs_one_time_out():
    """Frames of no request of ours are dropped until the deadline, and nothing is kept."""
    stray = bytes.fromhex("ffff 0000 0005 ff 04 02 0001") * 300
    with flooding(b"", stray) as port, little_is_held():
        url = parse_url(f"softmotion+modbus-tcp://127.0.0.1:{port}")
        client = open_modbus(url, timeout_s=0.3)
        with pytest.raises(TransportTimeoutError):
            client.read_input(0, 1)


def test_a_can_node_that_floods_is_named_before_anything_is_sent(monkeypatch):
    clock = FakeClock()
    bus = ScriptedBus(clock, node_with(0))
    line = CanLine(bus, "softmotion+can://desk")  # type: ignore[arg-type]
    link = CanopenMailboxLink(
        line,
        NODE,
        lambda _timeout_s: link,
        identity=IDENTITY,
        durable=True,
        timeout_s=1.0,
        clock=clock,
    )
    link.meet(start=True)
    sent = len(bus.sent)
    frame = can.Message(arbitration_id=SDO_ANSWER, data=bytes(8), is_extended_id=False)
    monkeypatch.setattr(bus, "recv", lambda timeout: frame)
    with little_is_held(), pytest.raises(RemoteProtocolError, match="without a pause"):
        link.beat(0x0101)
    assert len(bus.sent) == sent
