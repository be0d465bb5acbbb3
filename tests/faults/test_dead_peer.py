"""A controller that loses its power sends nothing: it is noticed all the same, and in time.

When idle within 3 s, and with a request under way within 1 s past its deadline. An idle serial line
shows nothing: there the next request does. ``pytest -s`` shows the measured times.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu
from robolink_simulators.hosting.streams.epson import serve_serial
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import RobolinkError, TransportError
from robolink.model import ToolOffset
from robolink.timing import Deadline, SystemClock
from robolink.transport import parse_url
from robolink.transport.tcp import TcpTransport, dial
from tests.faults._far_computer import far_computer
from tests.peers._faulty_proxy import SerialProxy

pytestmark = pytest.mark.soak

TIMEOUT_S = 1.0
IDLE_S = 2.8
PAST_S = 0.9
_LOAD_S = 0.3
"""A busy computer is late by this much."""

TCP = {
    "EPSON, TCP": ("epson", "--tcp", "{address}:0"),
    "Modbus TCP": ("softmotion", "--modbus-tcp", "{address}:0"),
    "OPC UA": ("softmotion", "--opcua", "{address}:0"),
}


@contextmanager
def modbus_rtu() -> Iterator[tuple[str, Callable[[], None]]]:
    with serve_modbus_rtu(SoftMotionSimulator()) as host:
        path, options = host.url.split("?")
        with SerialProxy("/" + path.partition(":///")[2]) as cable:
            url = f"softmotion+modbus-rtu://{cable.port}?{options}"
            yield url, lambda: cable.arm("F11")


@contextmanager
def canopen() -> Iterator[tuple[str, Callable[[], None]]]:
    with serve_canopen(SoftMotionSimulator(), CanPlace("virtual", "dead-peer")) as host:
        yield host.url, host.close


@contextmanager
def epson_serial() -> Iterator[tuple[str, Callable[[], None]]]:
    with serve_serial(EpsonSimulator()) as host:
        path, options = host.url.split("?")
        with SerialProxy("/" + path.partition(":///")[2]) as cable:
            yield f"epson+serial://{cable.port}?{options}", lambda: cable.arm("F11")


LINES = {"Modbus RTU": modbus_rtu, "EPSON, RS232": epson_serial, "CANopen": canopen}


def seconds(act: Callable[[], object]) -> float:
    """Return the time of a call that ends in a link error."""
    began = time.monotonic()
    with pytest.raises(RobolinkError):
        act()
    return time.monotonic() - began


def in_flight(url: str, cut: Callable[[], None]) -> dict[str, float]:
    """Cut, then read, then write; return both times, the read's past its deadline."""
    with robolink.connect(url, timeout_s=30.0) as controller:
        before = controller.tools.read(1)  # the simulator's first statement takes it a second
    with robolink.connect(url, timeout_s=TIMEOUT_S) as controller:
        cut()
        return {
            "read": seconds(controller.status) - TIMEOUT_S,
            "after": seconds(lambda: controller.tools.write(1, ToolOffset(1.0), expected=before)),
        }


@pytest.mark.fault("F11")
@pytest.mark.parametrize("kind", TCP)
def test_a_dead_peer_is_noticed_while_nothing_is_asked(kind):
    with far_computer(*TCP[kind]) as computer:
        url = replace(parse_url(computer.url), options={})
        clock = SystemClock()
        deadline = Deadline.after(clock, 5.0)
        transport = TcpTransport(dial(url, timeout_s=5.0, deadline=deadline), url, clock)
        computer.lose_power()
        began = time.monotonic()
        with pytest.raises(TransportError):
            transport.receive(deadline=Deadline.after(clock, 30.0))
        took_s = time.monotonic() - began
        transport.close()
    print(f"\n{kind}: idle, noticed after {took_s:.2f} s")  # noqa: T201
    assert took_s < IDLE_S + _LOAD_S


@pytest.mark.fault("F11")
@pytest.mark.parametrize("kind", TCP)
def test_a_dead_peer_ends_a_request_over_tcp(kind):
    with far_computer(*TCP[kind]) as computer:
        past = in_flight(computer.url, computer.lose_power)
    print(f"\n{kind}: {past['read']:.2f} s past the deadline")  # noqa: T201
    assert past["read"] < PAST_S + _LOAD_S
    assert past["after"] < PAST_S


@pytest.mark.parametrize("kind", LINES)
def test_a_dead_peer_ends_a_request_on_a_line(kind):
    with LINES[kind]() as (url, cut):
        past = in_flight(url, cut)
    print(f"\n{kind}: {past['read']:.2f} s past the deadline")  # noqa: T201
    assert past["read"] < PAST_S + _LOAD_S
    assert past["after"] < PAST_S
