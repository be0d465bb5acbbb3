"""A far end that never stops sending is reported after little of it was read.

The asserted figure is the largest memory of this process (tracemalloc), not the kernel's buffers:
the far end offers up to 64 MB and would go on.
"""

import contextlib
import os
import select
import socket
import termios
import threading
import time
import tracemalloc
import tty
from collections.abc import Iterator

import can
import pytest

import robolink
from robolink.errors import (
    ConnectError,
    RemoteProtocolError,
    RobolinkError,
)
from robolink.transport import open_modbus, parse_url
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from tests.unit._scripted_can import IDENTITY, NODE, SDO_ANSWER, FakeClock, ScriptedBus, node_with
from tests.unit._scripted_modbus import rtu, words

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
    """Do everything that happens only once before the memory of a flood is measured."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(tmp_path_factory.mktemp("state")))
        robolink.connect("epson+sim://flood-warm").close()
        with contextlib.suppress(ConnectError):
            open_modbus(parse_url("softmotion+modbus-tcp://127.0.0.1:1"), timeout_s=0.3)


@contextlib.contextmanager
def flooding(greeting: bytes, flood: bytes) -> Iterator[int]:
    """Serve one client on a port: answer its first bytes, then send endlessly."""

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
@pytest.mark.fault("F66")
def test_f66_an_epson_controller_that_floods_is_named_and_left(flood):
    with flooding(b"#Login,0\r\n", FLOODS[flood]) as port, little_is_held():
        controller = None
        with pytest.raises(RobolinkError) as caught:
            controller = robolink.connect(f"epson+tcp://127.0.0.1:{port}", timeout_s=1.0)
            time.sleep(0.05)  # nobody asked for the bytes of this time
            controller.status()
        if controller is not None:
            controller.close()
    assert isinstance(caught.value, RemoteProtocolError)
    assert caught.value.remedy
    assert len(str(caught.value)) < 1000


STRAYS = {
    "frames of other requests": bytes.fromhex("ffff 0000 0005 ff 04 02 0001") * 300,
    "the beginning of a frame": bytes.fromhex("ffff 0000 00fe ff 04") * 300,
    "no Modbus": bytes(4096),
}


@pytest.mark.parametrize("stray", STRAYS)
@pytest.mark.fault("F66")
def test_a_modbus_server_that_floods_is_named_at_once(stray):
    """No time-out: the error comes long before the deadline, after some 16 kB."""
    with flooding(b"", STRAYS[stray]) as port, little_is_held():
        url = parse_url(f"softmotion+modbus-tcp://127.0.0.1:{port}")
        client = open_modbus(url, timeout_s=60.0)
        with pytest.raises(RemoteProtocolError) as caught:
            client.read_input(0, 1)
    assert caught.value.remedy
    assert len(str(caught.value)) < 1000
    if stray == "frames of other requests":
        assert "bytes without an end" in caught.value.what


@contextlib.contextmanager
def flooded_line(flood: bytes, *, answers: bool) -> Iterator[str]:
    """A pseudo terminal whose far end sends bytes endlessly, at once or after one request."""
    far, near = os.openpty()
    tty.setraw(near)
    over = threading.Event()

    def serve() -> None:
        with contextlib.suppress(OSError):
            if answers:
                # Unit 1 is in step after the answer to its opening question: three registers.
                os.read(far, 256)
                os.write(far, rtu(words(1, 2, 3, function=3)))
                os.read(far, 256)
            while not over.is_set():
                if select.select([], [far], [], 0.1)[1]:
                    os.write(far, flood)

    os.set_blocking(far, True)
    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(near)
    finally:
        over.set()
        termios.tcflush(near, termios.TCIOFLUSH)
        thread.join(timeout=SOON_S)
        os.close(far)
        os.close(near)


LINE_FLOODS = {
    "frames of another unit": rtu(words(*range(100)), unit=9),
    "nothing but zeros": bytes(256),
}


@pytest.mark.parametrize("answers", [False, True], ids=["from the beginning", "later"])
@pytest.mark.parametrize("flood", LINE_FLOODS)
@pytest.mark.fault("F66")
def test_a_serial_line_that_floods_is_named_at_once(flood, answers):
    with flooded_line(LINE_FLOODS[flood], answers=answers) as device, little_is_held():
        url = parse_url(f"softmotion+modbus-rtu://{device}?baud=19200&parity=none&stopbits=1")
        with pytest.raises(RemoteProtocolError) as caught:
            client = open_modbus(url, timeout_s=60.0)
            with contextlib.closing(client):
                client.read_input(0, 1)
    what = caught.value.what
    assert caught.value.remedy
    if not answers:
        assert "is never quiet" in what
    elif flood == "frames of another unit":
        assert "bytes without an end" in what


@pytest.mark.fault("F66")
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
