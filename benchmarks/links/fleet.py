"""Thousands of simulated EPSON controllers on real sockets, served by one process.

Two thousand are opened; a client logs in to each and asks it once. As many are served by
``robolink sim run``. Then a thousand are asked by a
client in a process of its own, each again as soon as it has answered, by one selector and nothing
else: what is measured is the simulators. Where there are two CPUs each side has one.
"""

import contextlib
import json
import os
import selectors
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Final
from urllib.parse import urlsplit

from benchmarks.links.placing import a_cpu_each
from benchmarks.links.served_fleet import allow_descriptors
from benchmarks.links.sim_run import measure_sim_run
from benchmarks.table import Amount, Figure

OPENED: Final = 2_000
ASKED: Final = 1_000
SECONDS: Final = 4.0
WANTED_OPEN_S: Final = 1.0
WANTED_KIB: Final = 25.0
WANTED_PER_S: Final = 20_000
WANTED_P99_MS: Final = 60.0

_LOGIN: Final = b"$Login,\r\n"
_STATUS: Final = b"$GetStatus\r\n"


@dataclass(frozen=True, slots=True)
class Load:
    """What a number of connections gave.

    Attributes:
        per_s: Exchanges a second.
        p99_ms: So long or less took 99 of 100.
    """

    per_s: float
    p99_ms: float


def measure_fleet() -> Iterator[Figure]:
    """Yield how many controllers fit into a process, and how fast they answer."""
    wanted = "wanted"
    opened = opened_fleet(OPENED)
    for name, value, limit in (
        (f"{OPENED} served controllers opened", Amount(opened["seconds"], "s"), WANTED_OPEN_S),
        ("memory of each, untouched", Amount(opened["untouched_kib"], "KiB"), WANTED_KIB),
        ("memory of each, asked once by a client", Amount(opened["asked_kib"], "KiB"), WANTED_KIB),
    ):
        floor = Amount(limit, value.unit)
        yield Figure(name, value, wanted, floor, value.value / limit, 1.0)
    yield from measure_sim_run(OPENED, WANTED_OPEN_S, WANTED_KIB)
    load = measured_load(ASKED, SECONDS)
    rate = (Amount(load.per_s, "/s"), wanted, Amount(WANTED_PER_S, "/s"))
    yield Figure(f"exchanges over {ASKED} connections", *rate, WANTED_PER_S / load.per_s, 1.0)
    p99 = (Amount(load.p99_ms, "ms"), wanted, Amount(WANTED_P99_MS, "ms"))
    yield Figure("99 of 100 of these answered within", *p99, load.p99_ms / WANTED_P99_MS, 1.0)


def opened_fleet(count: int) -> dict[str, float]:
    """Return the seconds until so many are open, and what each takes before and after use."""
    with _fleet(count) as (said, ask_again), _clients(said["urls"]) as clients:
        untouched = said["kib_each"]
        for client in clients:
            client.sendall(_STATUS)
            client.recv(4096)
        asked = ask_again()["kib_each"]
    return {"seconds": said["seconds"], "untouched_kib": untouched, "asked_kib": asked}


def measured_load(count: int, seconds: float) -> Load:
    """Ask so many controllers for their status over and over, all at once."""
    with _fleet(count) as (said, _), _clients(said["urls"]) as clients:
        waits = _asked_for(clients, seconds)
    waits.sort()
    return Load(len(waits) / seconds, waits[len(waits) * 99 // 100] * 1000)


def _asked_for(clients: Sequence[socket.socket], seconds: float) -> list[float]:
    """Return how long each answer took."""
    waits: list[float] = []
    sent: dict[int, float] = {}
    with selectors.DefaultSelector() as selector:
        for client in clients:
            client.setblocking(False)
            selector.register(client, selectors.EVENT_READ)
            sent[client.fileno()] = perf_counter()
            client.send(_STATUS)
        end = perf_counter() + seconds
        while (now := perf_counter()) < end:
            for key, _ in selector.select(end - now):
                client = key.fileobj  # type: ignore[assignment]
                if not client.recv(4096):
                    raise AssertionError("a controller has hung up")
                answered = perf_counter()
                waits.append(answered - sent[key.fd])
                sent[key.fd] = answered
                client.send(_STATUS)
    return waits


@contextlib.contextmanager
def _clients(urls: Sequence[str]) -> Iterator[list[socket.socket]]:
    """Log in to each of some controllers."""
    allow_descriptors()
    with contextlib.ExitStack() as stack:
        clients = []
        for url in urls:
            parts = urlsplit(url)
            client = socket.create_connection((parts.hostname, parts.port or 0), timeout=30)
            clients.append(stack.enter_context(client))
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client.sendall(_LOGIN)
            client.recv(4096)
        yield clients


@contextlib.contextmanager
def _fleet(count: int) -> Iterator[tuple[dict[str, Any], Any]]:
    """Serve so many in a process of its own; gives what it said, and what asks it again."""
    command = [sys.executable, "-m", "benchmarks.links.served_fleet", str(count)]
    pipe = subprocess.PIPE
    with (
        subprocess.Popen(command, text=True, stdin=pipe, stdout=pipe) as process,
        a_cpu_each() as cpu,
    ):
        if cpu is not None:
            os.sched_setaffinity(process.pid, {cpu})
        asked, said = process.stdin, process.stdout
        assert asked is not None and said is not None  # noqa: S101, PT018 - pipes were asked for

        def ask_again() -> dict[str, Any]:
            asked.write("\n")
            asked.flush()
            return dict(json.loads(said.readline()))

        try:
            yield dict(json.loads(said.readline())), ask_again
        finally:
            asked.close()
