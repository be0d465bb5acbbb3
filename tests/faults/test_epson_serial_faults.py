"""An EPSON controller's serial line that echoes, has noise, is in use, or answers NAK for ever.

Rows F53 to F56 of the catalogue; the PLC's lines are tested in their own files.
"""

import os
import random
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_serial

import robolink
from robolink.errors import ConnectError, RobolinkError

NAK = b"\x15"


@contextmanager
def line_to(answer: Callable[[bytes], bytes]) -> Iterator[tuple[str, list[bytes]]]:
    """A pseudo terminal whose far end answers each piece; yields its URL and these pieces."""
    far, near = os.openpty()
    tty.setraw(near)
    over, heard = threading.Event(), list[bytes]()

    def serve() -> None:
        with suppress(OSError):
            while not over.is_set():
                if select.select([far], [], [], 0.05)[0]:
                    heard.append(os.read(far, 256))
                    os.write(far, answer(heard[-1]))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield f"epson+serial://{os.ttyname(near)}?baud=9600", heard
    finally:
        over.set()
        thread.join(5)
        os.close(far)
        os.close(near)


def refused(url: str) -> RobolinkError:
    """Fail to connect, without spinning meanwhile."""
    busy_s = time.process_time()
    with pytest.raises(RobolinkError) as caught:
        robolink.connect(url, timeout_s=0.5)
    assert time.process_time() - busy_s < 1.0
    assert caught.value.remedy
    return caught.value


@pytest.mark.fault("F53")
def test_f53_an_echo_is_never_the_answer_of_an_epson_controller():
    with line_to(lambda piece: piece) as (url, heard):
        refused(url)
    assert len(heard) <= 8


@pytest.mark.fault("F54")
def test_f54_noise_on_the_line_of_an_epson_controller_is_no_answer():
    noise = random.Random(54)
    with line_to(lambda _piece: noise.randbytes(noise.randint(1, 40))) as (url, heard):
        refused(url)
    assert len(heard) <= 8


@pytest.mark.fault("F55")
def test_f55_the_line_of_an_epson_controller_is_one_program_s():
    with serve_serial(EpsonSimulator(seed=3), clock=ScaledClock(40.0)) as host:
        with robolink.connect(host.url) as controller:
            with pytest.raises(ConnectError, match="cannot be opened"):
                robolink.connect(host.url)
            assert controller.status().ready


@pytest.mark.fault("F56")
@pytest.mark.parametrize(
    "answer",
    [
        lambda piece: NAK,
        lambda piece: NAK * 200,
        lambda piece: NAK + piece[1:2] + b"20" + bytes([0x30]),
    ],
    ids=["bare", "many", "with a code"],
)
def test_f56_nak_for_ever_ends_in_an_error_after_few_requests(answer):
    with line_to(answer) as (url, heard):
        refused(url)
    assert len(heard) <= 8
