"""Slow answers, slow movements, links that are reset: the deadline that applies to each.

Rows F67, F68 and F75 of the catalogue, over real sockets and a pseudo terminal.
"""

import contextlib
import os
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.errors import (
    OutcomeUnknownError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import MotionOutcome, MotionProfile, Path, ToolOffset, Verdict, WorkBox
from robolink.timing import NS_PER_S
from robolink.transaction import recover
from robolink.transport import open_modbus, parse_url
from tests.contract._softmotion_cell import SLOW, above, served
from tests.faults._firewall import behind_a_firewall
from tests.unit._scripted_modbus import rtu, tcp, words

TIMEOUT_S = 0.6
EACH_S = 0.25
"""The time between two bytes; the whole of any answer here takes 7 s and more."""

ANYWHERE = WorkBox()


# ---- F67


@contextmanager
def one_byte_at_a_time(greeting: bytes, answer: bytes) -> Iterator[int]:
    """Serve one client: greet it, then send the answer to its next request byte by byte."""
    over = threading.Event()

    def serve() -> None:
        client, _ = listener.accept()
        with client, contextlib.suppress(OSError):
            if greeting:
                client.recv(4096)
                client.sendall(greeting)
            client.recv(4096)
            for byte in answer:
                client.sendall(bytes([byte]))
                if over.wait(EACH_S):
                    return
            over.wait(5)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        over.set()
        thread.join(5)


@contextmanager
def within_the_deadline() -> Iterator[None]:
    began_s = time.monotonic()
    yield
    assert TIMEOUT_S * 0.9 < time.monotonic() - began_s < 5.0


@pytest.mark.fault("F67")
def test_f67_a_byte_now_and_then_does_not_renew_the_deadline_of_an_epson_controller():
    answer = b"#GetStatus,00100000001,0000\r\n"
    with one_byte_at_a_time(b"#Login,0\r\n", answer) as port:
        with robolink.connect(f"epson+tcp://127.0.0.1:{port}", timeout_s=TIMEOUT_S) as controller:
            with within_the_deadline(), pytest.raises(TransportTimeoutError):
                controller.status()


@pytest.mark.fault("F67")
def test_f67_nor_that_of_a_modbus_server():
    with one_byte_at_a_time(b"", tcp(words(*range(20)), 1)) as port:
        url = parse_url(f"softmotion+modbus-tcp://127.0.0.1:{port}")
        with contextlib.closing(open_modbus(url, timeout_s=TIMEOUT_S)) as client:
            with (
                within_the_deadline(),
                pytest.raises(TransportTimeoutError, match="bytes of its answer"),
            ):
                client.read_input(0, 20)


@pytest.mark.fault("F67")
def test_f67_nor_that_of_a_serial_line():
    far, near = os.openpty()
    tty.setraw(near)
    over = threading.Event()

    def serve() -> None:
        with contextlib.suppress(OSError):
            os.read(far, 256)
            for byte in rtu(words(*range(20), function=3)):
                os.write(far, bytes([byte]))
                if over.wait(EACH_S):
                    return

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    url = f"softmotion+modbus-rtu://{os.ttyname(near)}?baud=19200&parity=none&stopbits=1"
    try:
        with within_the_deadline(), pytest.raises(RobolinkError):
            open_modbus(parse_url(url), timeout_s=TIMEOUT_S)
    finally:
        over.set()
        thread.join(5)
        os.close(far)
        os.close(near)


# ---- F68


@pytest.mark.fault("F68")
def test_f68_a_movement_of_two_minutes_is_no_silence_on_epson():
    simulator = EpsonSimulator(seed=2)
    register("f68", simulator)
    try:
        with robolink.connect("epson+sim://f68", timeout_s=0.5) as controller:
            controller.motors(True)
            group = controller.groups[0]
            here, began_ns = group.pose(), controller.clock.now_ns()
            creeping = MotionProfile(Path.STRAIGHT, 1, 0.25)
            motion = group.move_to(replace(here, z_mm=here.z_mm + 30), creeping, box=ANYWHERE)
            asked = controller.exchanges
            assert motion.wait(timeout_s=600) is MotionOutcome.ARRIVED
            took_s = (controller.clock.now_ns() - began_ns) / NS_PER_S
            assert took_s > 110
            # The state was read meanwhile, so a stop of the machine would have shown.
            assert controller.exchanges - asked > took_s / 5
            assert controller.outcomes.open_markers() == ()
        assert simulator.machine.arm.moves_started == 1
    finally:
        unregister("f68")


@pytest.mark.fault("F68")
def test_f68_a_movement_of_twelve_seconds_is_no_silence_on_a_plc():
    with served("sim") as cell, cell.connect(timeout_s=0.5) as controller:
        group = controller.groups[0]
        here, began_ns = group.pose(), controller.clock.now_ns()
        creeping = replace(SLOW, speed_mm_s=0.5)
        motion = group.move_to(above(here, 6.0), creeping, box=ANYWHERE)
        assert motion.wait(timeout_s=600) is MotionOutcome.ARRIVED
        assert (controller.clock.now_ns() - began_ns) / NS_PER_S > 11
        assert cell.movements_started == 1
        assert cell.open_requests == []


# ---- F75


@pytest.fixture(params=["epson", "mailbox"])
def far_end(request: pytest.FixtureRequest) -> Iterator[tuple[str, Callable[[], int]]]:
    """A controller, and the number of writes of its tool 1."""
    if request.param == "epson":
        simulator = EpsonSimulator(seed=2)
        written = simulator.machine.flash_writes
        with serve_tcp(simulator) as host:
            yield host.url, lambda: simulator.machine.flash_writes - written
    else:
        with served("modbus-tcp") as cell:
            begun = cell.slot_changes(1)
            yield cell.url, lambda: cell.slot_changes(1) - begun


@pytest.mark.fault("F75")
def test_f75_a_link_that_is_reset_while_idle_leaves_nothing_in_doubt(far_end):
    url, writes = far_end
    with behind_a_firewall(url) as (firewall, there):
        with robolink.connect(there) as controller:
            before = controller.tools.read(1)
            assert controller.outcomes.open_markers() == ()
            firewall.reset()
            with pytest.raises(TransportBrokenError) as broken:
                controller.tools.read(1)
            assert "ry again" in broken.value.remedy
            assert controller.outcomes.open_markers() == ()
            # A PLC is read once more, to distinguish its restart from a broken link; no more than
            # that.
            assert firewall.opened <= 2
        with robolink.connect(there) as controller:
            controller.require_settled("a movement")
            assert before is not None
            controller.tools.write(1, moved(before), expected=before)
    assert writes() == 1


def carries_a_command(data: bytes) -> bool:
    return b"TLSet 1, XY" in data or len(data) > 100  # the 64 words of the mailbox


def moved(offset: ToolOffset) -> ToolOffset:
    return ToolOffset(offset.x_mm + 0.25, offset.y_mm, offset.z_mm)


@pytest.mark.fault("F75")
def test_f75_a_write_that_is_reset_in_flight_is_unproved_and_not_sent_again(far_end):
    url, writes = far_end
    with behind_a_firewall(url) as (firewall, there):
        with robolink.connect(there) as controller:
            before = controller.tools.read(1)
            assert before is not None
            controller.tools.write(1, moved(before), expected=before)  # now the mailbox is ours
            now = controller.tools.read(1)
            assert now is not None
            firewall.reset_at = carries_a_command
            with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
                controller.tools.write(1, before, expected=now)
            assert firewall.opened <= 2
        firewall.reset_at = lambda _data: False
        with robolink.connect(there) as controller:
            with pytest.raises(OutcomeUnknownError, match="did not finish"):
                controller.require_settled("a movement")
            (settled,) = recover(controller).settled
            assert settled.verdict is Verdict.DONE
            assert controller.tools.same(controller.tools.read(1), before)
    assert writes() == 2
