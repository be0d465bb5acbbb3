"""Many threads on one controller: one procedure at a time, and no thread gets another's answer.

Rows F48 and F49 of the catalogue, on the wires of each kind; the simulator's own log is the
witness.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.errors import (
    BusyError,
    LeaseHeldError,
    LeaseLostError,
    OutcomeUnknownError,
    RemoteProtocolError,
    RobolinkError,
    ToolChangedError,
)
from robolink.journal import memory_journal
from robolink.model import Controller, MotionProfile, Path, ToolOffset, Verdict, WorkBox
from robolink.protocols.mailbox import to_frame
from robolink.transaction import Wanted, change_tools, recover
from tests._patience import PATIENCE_S
from tests.contract._softmotion_cell import served

THREADS = 100
AT_ONCE = 12
REFUSALS = (LeaseHeldError, LeaseLostError, ToolChangedError)


def tool(number: int) -> ToolOffset:
    return ToolOffset(10.0 + number, -number, -20.5)


def together(acts: Sequence[Callable[[], object]]) -> list[object]:
    """Run all at the same moment; return each result, a refusal as its kind."""
    ends: list[object] = [None] * len(acts)
    gate = threading.Barrier(len(acts))

    def run(number: int) -> None:
        gate.wait(PATIENCE_S)
        try:
            ends[number] = acts[number]()
        except RobolinkError as error:
            ends[number] = type(error)

    threads = [threading.Thread(target=run, args=(number,)) for number in range(len(acts))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert not any(thread.is_alive() for thread in threads)
    return ends


@pytest.fixture
def epson() -> Iterator[tuple[EpsonSimulator, str]]:
    simulator = EpsonSimulator(seed=2)
    for number in range(1, 16):
        simulator.machine.tools.set(number, tool(number))
    with serve_tcp(simulator, clock=ScaledClock(20.0)) as host:
        yield simulator, host.url


def admitted(controller: Controller, others: threading.Semaphore) -> str:
    """Begin a procedure and stay in it until all others were refused."""
    try:
        with controller.preserved("a procedure"):
            for _ in range(AT_ONCE - 1):
                assert others.acquire(timeout=PATIENCE_S), "somebody else was let in, or hangs"
            return "admitted"
    except BusyError:
        others.release()
        raise


@pytest.mark.fault("F48")
def test_f48_of_many_that_begin_at_the_same_moment_one_is_admitted_on_epson(epson):
    with robolink.connect(epson[1]) as controller:
        others = threading.Semaphore(0)
        ends = together([lambda: admitted(controller, others)] * AT_ONCE)
        assert ends.count("admitted") == 1
        assert ends.count(BusyError) == AT_ONCE - 1
        # And of as many movements that are asked for at once one begins.
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        target, creeping = replace(here, z_mm=here.z_mm + 30), MotionProfile(Path.STRAIGHT, 1, 1.0)
        began = epson[0].machine.arm.moves_started
        moves = together([lambda: group.move_to(target, creeping, box=WorkBox())] * AT_ONCE)
        controller.stop()
        refused = [end for end in moves if isinstance(end, type)]
        assert len(refused) == AT_ONCE - 1
        assert epson[0].machine.arm.moves_started == began + 1


@pytest.mark.fault("F48")
def test_f48_of_many_that_connect_and_change_one_tool_of_a_plc_one_does(tmp_path):
    """Or none, and the possible one is told that it is unconfirmed.

    A mailbox shows only the answer to its last command, whoever gave it. So on a busy computer the
    refusal of one may hide the answer to the write of another, or overwrite its block. The PLC may
    also carry out the last write after all of them have given up: the changes are counted when
    ``recover`` has had its answers.
    """
    with served("modbus-tcp") as cell:
        journal = memory_journal(tmp_path.name)
        with cell.connect() as controller:
            old = controller.tools.read(1)

        def job(number: int) -> str:
            outcomes = journal.log(cell.url)
            with robolink.connect(cell.url, outcomes=outcomes) as controller:
                change_tools(controller, [Wanted(1, tool(number), old)])
            return f"done {number}"

        slots = cell.slot_changes(1)
        ends = together([partial(job, number) for number in range(6)])
        done = [end for end in ends if isinstance(end, str)]
        doubted = ends.count(OutcomeUnknownError)
        overtaken = {OutcomeUnknownError, RemoteProtocolError}
        assert {end for end in ends if not isinstance(end, str)} <= {*REFUSALS, *overtaken}
        with robolink.connect(cell.url, outcomes=journal.log(cell.url)) as later:
            recovery = recover(later)
            now = later.tools.read(1)
        changes = cell.slot_changes(1) - slots
        assert len(done) <= changes <= 1
        assert changes == len(done) or doubted
        assert done or doubted  # one of them got that far
        found = [finding.verdict for finding in (*recovery.settled, *recovery.left)]
        assert bool(found) == bool(doubted)
        assert found.count(Verdict.DONE) == changes - len(done)
        held = {end: tool(number) for number, end in enumerate(ends)}
        for end in done:
            assert controller.tools.same(now, held[end])


@pytest.mark.fault("F49")
def test_f49_a_hundred_threads_on_an_epson_controller_each_hear_their_own_answer(epson):
    simulator, url = epson

    def ask(number: int) -> bool:
        index = number % 15 + 1
        return controller.tools.read(index) == tool(index) and controller.status().ready

    with robolink.connect(url) as controller:
        begun = len(simulator.log)
        assert together([partial(ask, number) for number in range(THREADS)]) == [True] * THREADS
    way = [direction for _, direction, _ in list(simulator.log)[begun:]]
    assert len(way) > 4 * THREADS
    assert way == [">", "<"] * (len(way) // 2)


@pytest.mark.fault("F49")
@pytest.mark.parametrize(
    "bus",
    [
        "modbus-tcp",
        *(pytest.param(b, marks=pytest.mark.soak) for b in ("modbus-rtu", "can-virtual")),
    ],
)
def test_f49_threads_on_a_plc_each_hear_their_own_answer(bus):
    with served(bus) as cell, cell.connect() as controller:
        for number in range(2, 8):
            value = to_frame(tool(number).components(), unit_um=1000.0)
            cell.simulator.plc.memory.define(number, value, "tool")

        def ask(number: int) -> bool:
            index = number % 6 + 2
            return controller.tools.same(controller.tools.read(index), tool(index))

        assert together([partial(ask, number) for number in range(18)]) == [True] * 18
