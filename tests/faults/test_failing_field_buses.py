"""A bus that fails, a foreign node, noise, an adapter that is pulled out.

Rows F50, F51 and F54 of the catalogue, on a virtual CAN bus and on pseudo terminals.
"""

import os
import random
import select
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import Any

import can
import pytest
from can.interfaces.virtual import VirtualBus
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.errors import (
    ConnectError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
)
from robolink.model import ToolOffset
from robolink.transport import open_mailbox_link, open_modbus, parse_url
from robolink.transport.modbus.client import ModbusClient
from tests.contract._softmotion_cell import PlcCell, served
from tests.unit._scripted_can import SDO_ANSWER
from tests.unit._scripted_modbus import rtu, words

SOON_S = 5.0


@pytest.mark.fault("F50")
def test_f50_a_bus_error_reaches_everybody_who_waits(tmp_path, monkeypatch):
    failed = threading.Event()
    receive = VirtualBus._recv_internal

    def failing(bus: Any, timeout: float | None) -> Any:
        if failed.is_set():
            raise can.CanOperationError("the adapter was unplugged")
        return receive(bus, timeout)

    simulator = SoftMotionSimulator()
    with serve_canopen(simulator, CanPlace("virtual", tmp_path.name)) as host:
        with closing(open_mailbox_link(host.url, timeout_s=60.0)) as link:
            link.read_head()
            host.close()  # nothing comes any more, and the heartbeat expires in a while
            monkeypatch.setattr(VirtualBus, "_recv_internal", failing)
            ends: list[RobolinkError] = []

            def wait() -> None:
                try:
                    link.read_response()
                except RobolinkError as error:
                    ends.append(error)

            waiting = [threading.Thread(target=wait) for _ in range(4)]
            for thread in waiting:
                thread.start()
            failed.set()
            began_s = time.monotonic()
            for thread in waiting:
                thread.join(SOON_S)
            assert time.monotonic() - began_s < SOON_S
            assert len(ends) == 4
            assert {type(error) for error in ends} <= {TransportBrokenError, TransportClosedError}
            assert sum("unplugged" in str(error) for error in ends) == 1
            # It is not reopened by itself, and reports at once that it has ended.
            with pytest.raises(TransportClosedError, match=r"has ended|is closed"):
                link.beat(0x0101)


@contextmanager
def third_node(cell: PlcCell, at: str) -> Iterator[None]:
    """Let another device answer such a request with our node's identifier, before our node does."""
    channel = cell.url.partition("://")[2].partition("?")[0]
    bus = can.Bus(interface="virtual", channel=channel)
    other_object = b"\x43\x04\x22\x01\x01\x02\x03\x04"
    frame = can.Message(arbitration_id=SDO_ANSWER, data=other_object, is_extended_id=False)
    cell.simulator.on_request = lambda _number, text: bus.send(frame) if at in text else None
    try:
        yield
    finally:
        cell.simulator.on_request = None
        bus.shutdown()


@pytest.mark.fault("F51")
def test_f51_an_answer_of_another_node_is_not_taken_for_ours():
    with served("can-virtual") as cell, cell.connect() as controller, third_node(cell, "read_slot"):
        with pytest.raises(RemoteProtocolError, match="second node with this number"):
            controller.tools.read(1)


@pytest.mark.fault("F51")
def test_f51_a_write_that_another_node_answers_is_unproved_and_not_written_again():
    with served("can-virtual") as cell:
        with cell.connect() as controller, third_node(cell, "write_command WRITE"):
            with pytest.raises(OutcomeUnknownError):
                controller.tools.write(3, ToolOffset(1.0, 2.0, 3.0), expected=None)
        assert cell.commands.count("WRITE_TOOL") == 1
        assert cell.slot_changes(3) <= 1
        assert len(cell.open_requests) == 1


@contextmanager
def line_to(answers: Any) -> Iterator[tuple[str, list[int], int]]:
    """A pseudo terminal whose far end answers the nth piece with ``answers(n)``."""
    far, near = os.openpty()
    tty.setraw(near)
    over, asked = threading.Event(), list[int]()

    def serve() -> None:
        with suppress(OSError):
            while not over.is_set():
                if select.select([far], [], [], 0.05)[0]:
                    asked.append(len(os.read(far, 256)))
                    os.write(far, answers(len(asked)))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(near), asked, far
    finally:
        over.set()
        thread.join(SOON_S)
        with suppress(OSError):
            os.close(far)
        os.close(near)


def opened(device: str, timeout_s: float) -> ModbusClient:
    url = f"softmotion+modbus-rtu://{device}?baud=19200&parity=none&stopbits=1"
    return open_modbus(parse_url(url), timeout_s=timeout_s)


@pytest.mark.fault("F54")
def test_f54_another_baud_rate_or_parity_is_named_and_nothing_is_read_from_the_noise():
    noise = random.Random(54)
    with line_to(lambda _n: noise.randbytes(noise.randint(1, 40))) as (device, asked, _far):
        busy_s = time.process_time()
        with pytest.raises((ConnectError, RemoteProtocolError)) as caught:
            opened(device, 0.5)
        assert time.process_time() - busy_s < 0.3  # it waits, and does not spin
    assert len(asked) <= 3
    assert caught.value.remedy


@pytest.mark.fault("F54")
def test_f54_an_adapter_that_is_pulled_out_is_named_and_not_tried_again():
    far, near = os.openpty()
    tty.setraw(near)
    device = os.ttyname(near)

    def answer() -> None:
        os.read(far, 256)
        os.write(far, rtu(words(1, 2, 3, function=3)))

    thread = threading.Thread(target=answer)
    thread.start()
    client = opened(device, 3.0)
    thread.join(SOON_S)
    os.close(near)
    os.close(far)  # the cable, and with it the port, is gone
    with closing(client):
        for _ in range(50):
            with pytest.raises(TransportError) as caught:
                client.read_input(0, 1)
            assert caught.value.remedy
