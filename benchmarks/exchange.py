"""One status exchange: the whole driver against a raw blocking socket, same simulator.

The simulator runs in a process of its own. The two clients take turns, since a controller
serves one at a time, and the floor is measured again before every round.
"""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from statistics import median
from time import perf_counter_ns
from urllib.parse import urlsplit

import robolink
from benchmarks.table import Figure
from robolink.markers import MemoryOutcomeLog

ROUNDS = 15
EXCHANGES = 1_000
WARM_UP = 150


def measure_exchange() -> Iterator[Figure]:
    """Yield the figures of a GetStatus exchange over TCP."""
    with _simulator() as url:
        raw: list[float] = []
        driver: list[float] = []
        for _ in range(ROUNDS):
            raw.append(_raw_round(url))
            driver.append(_driver_round(url))
    ratios = [ours / floor for ours, floor in zip(driver, raw, strict=True)]
    yield Figure("status exchange, raw blocking socket client", f"{median(raw):.1f} us")
    yield Figure(
        "status exchange, robolink (lock, stale check, deadline, codec)",
        f"{median(driver):.1f} us",
        median(ratios),
        1.35,
    )


@contextlib.contextmanager
def _simulator() -> Iterator[str]:
    command = [sys.executable, "-m", "robolink_cli", "sim", "epson", "--tcp", "127.0.0.1:0"]
    process = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None  # noqa: S101 - a pipe was asked for
        yield json.loads(process.stdout.readline())["url"]
    finally:
        os.kill(process.pid, signal.SIGTERM)
        process.communicate(timeout=10)


def _raw_round(url: str) -> float:
    parts = urlsplit(url)
    with socket.create_connection((parts.hostname, parts.port or 0)) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

        def ask(request: bytes) -> bytes:
            link.sendall(request)
            return link.recv(4096)

        ask(b"$Login,\r\n")
        for _ in range(WARM_UP):
            ask(b"$GetStatus\r\n")
        start = perf_counter_ns()
        for _ in range(EXCHANGES):
            ask(b"$GetStatus\r\n")
        passed = perf_counter_ns() - start
        ask(b"$Logout\r\n")
    return passed / EXCHANGES / 1000


def _driver_round(url: str) -> float:
    with robolink.connect(url, outcomes=MemoryOutcomeLog()) as controller:
        for _ in range(WARM_UP):
            controller.status()
        start = perf_counter_ns()
        for _ in range(EXCHANGES):
            controller.status()
        return (perf_counter_ns() - start) / EXCHANGES / 1000
