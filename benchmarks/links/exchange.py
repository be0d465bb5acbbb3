"""One status exchange: the whole driver against a raw blocking socket, same simulator.

The simulator runs in a process of its own. The two clients take turns, since a controller
serves one at a time, and the floor is measured again before every round.

Both ways of sharing the machine are shown where it has two CPUs. A controller is another
computer, so the goal stands where client and simulator have a CPU each. On one CPU the two
Python processes take turns in the same caches: there the driver's own work (about 10 us when
measured alone) costs twice that, and slows the simulator's answer down as well.
"""

import os
import socket
from collections.abc import Iterator
from statistics import median
from time import perf_counter_ns
from urllib.parse import urlsplit

import robolink
from benchmarks.links.opcua_reads import opcua_reads
from benchmarks.links.placing import a_cpu_each, served_simulator
from benchmarks.table import Amount, Figure
from robolink.journal import memory_journal

ROUNDS = 15
EXCHANGES = 1_000
WARM_UP = 150


def measure_exchange() -> Iterator[Figure]:
    """Yield the figures of a GetStatus exchange over TCP, and of reads over OPC UA."""
    with a_cpu_each() as simulator_cpu:
        if simulator_cpu is None:
            yield from _compare("where the system put them", goal=1.35)
        else:
            yield from _compare("a CPU each", goal=1.35, simulator_cpu=simulator_cpu)
            (ours,) = os.sched_getaffinity(0)
            yield from _compare("sharing one CPU", goal=None, simulator_cpu=ours)
        yield from opcua_reads(simulator_cpu)


def _compare(
    placed: str, *, goal: float | None, simulator_cpu: int | None = None
) -> Iterator[Figure]:
    with served_simulator(simulator_cpu) as url:
        rounds = [(_raw_round(url), _driver_round(url)) for _ in range(ROUNDS)]
    raw, driver = (median(column) for column in zip(*rounds, strict=True))
    yield Figure(
        f"status exchange ({placed})",
        Amount(driver, "us"),
        "raw blocking socket",
        Amount(raw, "us"),
        median(ours / floor for floor, ours in rounds),
        goal,
    )


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
    with robolink.connect(url, outcomes=memory_journal(url).log(url)) as controller:
        for _ in range(WARM_UP):
            controller.status()
        start = perf_counter_ns()
        for _ in range(EXCHANGES):
            controller.status()
        return (perf_counter_ns() - start) / EXCHANGES / 1000
