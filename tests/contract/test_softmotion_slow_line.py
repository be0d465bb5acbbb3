"""A movement on a serial line at 9600 baud, while another thread asks for everything it can.

Line and PLC run at half their pace here, so that a busy machine does not decide the outcome.
"""

import threading
from contextlib import ExitStack

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.journal import memory_journal
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from tests.contract._softmotion_cell import above

PACE = 0.5
BAUD = 9600


@pytest.fixture
def slow_line():
    with ExitStack() as stack:
        simulator = SoftMotionSimulator(seed=7)
        host = stack.enter_context(
            serve_modbus_rtu(simulator, baud=round(PACE * BAUD), clock=ScaledClock(PACE))
        )
        log = memory_journal("slow line").log(host.url)
        yield simulator, stack.enter_context(robolink.connect(host.url, outcomes=log))


@pytest.mark.parametrize("what", ["slots", "states"])
def test_another_thread_that_reads_all_the_time_lets_every_beat_through(slow_line, what):
    simulator, controller = slow_line
    group = controller.groups[0]
    over, reads = threading.Event(), []

    def read_on():
        while not over.is_set():
            reads.append(controller.tools.read(1) if what == "slots" else controller.status())

    target = above(group.pose(), 3.0)
    reader = threading.Thread(target=read_on)
    motion = group.move_to(target, MotionProfile(Path.STRAIGHT, speed_mm_s=2.0), box=WorkBox())
    reader.start()
    try:
        assert motion.wait(timeout_s=20) is MotionOutcome.ARRIVED
    finally:
        over.set()
        reader.join()
    assert len(reads) > 2
    assert simulator.plc.group.movements_started == 1
