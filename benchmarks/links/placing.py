"""Which CPU client and simulator have, where there are two: a controller is another computer."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def a_cpu_each() -> Iterator[int | None]:
    """Keep this process on one CPU for the block.

    Yields:
        Another CPU, for the simulator; ``None`` where there is none, or none can be chosen.
    """
    cpus = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    if len(cpus) < 2:
        yield None
        return
    os.sched_setaffinity(0, {cpus[0]})
    try:
        yield cpus[1]
    finally:
        os.sched_setaffinity(0, set(cpus))


@contextmanager
def served_simulator(
    cpu: int | None, serving: Sequence[str] = ("epson", "--tcp", "127.0.0.1:0")
) -> Iterator[str]:
    """Serve a simulator in a process of its own, on the CPU ``cpu``; gives its URL."""
    with served_simulators(cpu, serving) as told:
        yield told["url"]


@contextmanager
def served_simulators(cpu: int | None, serving: Sequence[str]) -> Iterator[Mapping[str, Any]]:
    """Serve as :func:`served_simulator`; gives all that it says, a URL for each medium with it."""
    command = [sys.executable, "-m", "robolink_cli", "sim", *serving, "--json"]
    with answering(command, cpu) as told:
        yield told


@contextmanager
def answering(command: Sequence[str], cpu: int | None) -> Iterator[Mapping[str, Any]]:
    """Keep a process on the CPU ``cpu`` for the block; gives the JSON that it prints first."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        if cpu is not None:
            os.sched_setaffinity(process.pid, {cpu})
        assert process.stdout is not None  # noqa: S101 - a pipe was asked for
        yield json.loads(process.stdout.readline())
    finally:
        process.terminate()
        try:
            process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise
