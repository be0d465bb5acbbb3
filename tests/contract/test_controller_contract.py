"""Every kind of controller keeps the promises that ``robolink.testing`` looks at."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.controllers import ConnectionTerms
from robolink.journal import signature_here
from robolink.model import Controller, ToolOffset
from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    MemoryController,
    MemoryMachine,
    Subject,
)
from robolink.transport import parse_url
from tests.contract.third_kind import BenchServer, open_bench
from tests.unit._plc_bench import COMMIT_BIT, Bench


def switch_on(controller: Controller) -> None:
    controller.motors(True)


@contextmanager
def memory() -> Iterator[Subject]:
    machine = MemoryMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)})
    yield Subject(lambda: MemoryController(machine))


@contextmanager
def epson() -> Iterator[Subject]:
    in_process.register("contract", EpsonSimulator(seed=3))
    try:
        yield Subject(lambda: robolink.connect("epson+sim://contract"), prepare=switch_on)
    finally:
        in_process.unregister("contract")


@contextmanager
def softmotion() -> Iterator[Subject]:
    plc_in_process.register("contract", SoftMotionSimulator(seed=3))
    try:
        yield Subject(lambda: robolink.connect("softmotion+sim://contract"), prepare=switch_on)
    finally:
        plc_in_process.unregister("contract")


@contextmanager
def plc_map() -> Iterator[Subject]:
    bench = Bench(COMMIT_BIT, identity="plc+modbus-tcp://contract")
    yield Subject(bench.connect, tool=min(bench.map.slots))


@contextmanager
def third_kind() -> Iterator[Subject]:
    with BenchServer() as server:
        url, terms = parse_url(server.url), ConnectionTerms(signature_here("test"))
        yield Subject(lambda: open_bench(url, terms))


KINDS = {kind.__name__: kind for kind in (memory, epson, softmotion, plc_map, third_kind)}
IMMOBILE = ["plc_map"]
CASES = [
    *((kind, check) for kind in KINDS for check in (*READING_CHECKS, *WRITING_CHECKS)),
    *((kind, check) for kind in KINDS if kind not in IMMOBILE for check in MOVING_CHECKS),
]


@pytest.mark.parametrize(
    ("kind", "check"), CASES, ids=[f"{kind}-{check.__name__}" for kind, check in CASES]
)
def test_a_kind_of_controller_keeps_its_promises(kind, check):
    with KINDS[kind]() as subject:
        check(subject)
