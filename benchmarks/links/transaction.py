"""One transactional tool write against what it cannot do without, in the same run.

That is two durable commits and three exchanges: the intent before the write, its end after
it; read, write and read back. The floor is the same on bare ``sqlite3`` (WAL, FULL, one row
a commit) and on a raw blocking socket. As in :mod:`benchmarks.links.exchange` the simulator has a
process, and where there are two a CPU, of its own.
"""

import contextlib
import socket
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter_ns
from urllib.parse import urlsplit

import robolink
from benchmarks.links.placing import a_cpu_each, served_simulator
from benchmarks.table import Amount, Figure
from robolink.journal import open_journal
from robolink.model import ToolOffset
from robolink.transaction import Wanted, change_tools

ROUNDS = 15
WRITES = 40
GOAL = 1.5

_OFFSETS = (ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.125, -3.25, -20.0))


def measure_transaction() -> Iterator[Figure]:
    """Yield the figures of a tool write that is journalled and read back."""
    with a_cpu_each() as simulator_cpu:
        yield from _compare(simulator_cpu)


def _compare(simulator_cpu: int | None) -> Iterator[Figure]:
    with TemporaryDirectory() as folder, served_simulator(simulator_cpu) as url:
        rounds = [
            (_floor_round(url, Path(folder)), *_driver_round(url, Path(folder)))
            for _ in range(ROUNDS)
        ]
    floor, write, change = (median(column) for column in zip(*rounds, strict=True))
    against, bare_us = "two bare SQLite commits, three raw exchanges", Amount(floor, "us")
    ratio = median(ours / bare for bare, ours, _ in rounds)
    ours_us = Amount(write, "us")
    yield Figure("transactional tool write", ours_us, against, bare_us, ratio, GOAL)
    ratio = median(ours / bare for bare, _, ours in rounds)
    ours_us = Amount(change, "us")
    yield Figure("the same as a change that compares first", ours_us, against, bare_us, ratio)


def _floor_round(url: str, folder: Path) -> float:
    with _raw_client(url) as ask, _bare_database(folder / "bare.db") as commit:
        reading = b'$Execute,"Print TLSet(1)"\r\n'

        def write(offset: ToolOffset) -> None:
            ask(reading)
            commit()
            point = "{:.3f},{:.3f},{:.3f},{:.3f}".format(*offset.components())
            ask(f'$Execute,"TLSet 1, XY({point})"\r\n'.encode())
            ask(reading)
            commit()

        return _microseconds(write)


def _driver_round(url: str, folder: Path) -> tuple[float, float]:
    journal = open_journal(str(folder / "journal.db"))
    with robolink.connect(url, outcomes=journal.log(url)) as controller:
        stored = controller.tools.read(1)

        def write(offset: ToolOffset) -> None:
            nonlocal stored
            stored = controller.tools.write(1, offset, expected=stored).read_back

        def change(offset: ToolOffset) -> None:
            nonlocal stored
            (receipt,) = change_tools(controller, [Wanted(1, offset, stored)])
            stored = receipt.read_back

        return _microseconds(write), _microseconds(change)


def _microseconds(write: Callable[[ToolOffset], None]) -> float:
    for number in range(4):
        write(_OFFSETS[number % 2])
    passed_ns = []
    for number in range(WRITES):
        start = perf_counter_ns()
        write(_OFFSETS[number % 2])
        passed_ns.append(perf_counter_ns() - start)
    # The disk delays an occasional commit, which would count against the side it hits.
    return median(passed_ns) / 1000


@contextlib.contextmanager
def _raw_client(url: str) -> Iterator[Callable[[bytes], bytes]]:
    parts = urlsplit(url)
    with socket.create_connection((parts.hostname, parts.port or 0)) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

        def ask(request: bytes) -> bytes:
            link.sendall(request)
            return link.recv(4096)

        ask(b"$Login,\r\n")
        yield ask
        ask(b"$Logout\r\n")


@contextlib.contextmanager
def _bare_database(path: Path) -> Iterator[Callable[[], None]]:
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute("CREATE TABLE IF NOT EXISTS rows (text TEXT)")

    def commit() -> None:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("INSERT INTO rows VALUES (?)", ("x" * 300,))
        connection.execute("COMMIT")

    try:
        yield commit
    finally:
        connection.close()
