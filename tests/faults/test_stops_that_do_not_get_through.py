"""A stop that is refused, lost, or waits behind something keeps no robot moving.

What counts is how far the tip goes after the press. It moves 100 mm at 10 mm/s, and stands after a
few of them, whatever becomes of the stop: what robolink keeps going by its heartbeats, it no longer
keeps going then.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest
from robolink_simulators.faults import PlcFault, PlcFaultAction

from robolink.controllers import SoftMotionController, stop_now
from robolink.errors import MotionTimeoutError, OutcomeUnknownError, RobolinkError
from robolink.model import Motion, MotionProfile, Path, WorkBox
from tests.contract._softmotion_cell import PlcCell, above, served

WAY_MM, AT = 100.0, MotionProfile(Path.STRAIGHT, speed_mm_s=10.0)
SOON_MM = 40.0
"""Four seconds of way: far from what a stop takes on a slow machine, and from the target."""

BUSY = 6
FOR_EVER = {"every": 1}
EXCEPTION, LOST = PlcFaultAction.MODBUS_EXCEPTION, PlcFaultAction.IGNORE_WRITE


class Press:
    """A robot under way whose movement is waited on in another thread, and the tip's way.

    Attributes:
        cell: The PLC.
        controller: The open session.
        ends: What the waiting thread met.
    """

    def __init__(
        self, cell: PlcCell, controller: SoftMotionController, onlooker: SoftMotionController
    ) -> None:
        self.cell, self.controller, self._onlooker = cell, controller, onlooker
        self.group = controller.groups[0]
        self.ends: list[object] = []
        self._threads: list[threading.Thread] = []

    def begin(self) -> Motion:
        """Start the movement."""
        return self.group.move_to(above(self.group.pose(), -WAY_MM), AT, box=WorkBox())

    def beside(self, act: Callable[[], object]) -> None:
        """Run something in a thread of its own."""

        def run() -> None:
            try:
                self.ends.append(act())
            except RobolinkError as error:
                self.ends.append(error)

        self._threads.append(threading.Thread(target=run))
        self._threads[-1].start()

    def under_way(self) -> float:
        """Move in another thread that waits; return where the tip is once it has gone 1 mm."""
        start, clock = self.height_mm, self.cell.clock
        self.beside(lambda: self.begin().wait(timeout_s=60))
        while abs(self.height_mm - start) < 1.0:
            clock.sleep(0.01)
        return self.height_mm

    def fail(self, action: PlcFaultAction, match: str, **options: Any) -> None:
        """Plan a fault of the link to the PLC."""
        fault = PlcFault(action, match=f"write_command {match}", **options)
        self.cell.simulator.faults.add(fault)

    @property
    def height_mm(self) -> float:
        """Where another client sees the tip."""
        return self._onlooker.groups[0].pose().z_mm

    def rests(self) -> float:
        """Return where the tip is, once it stands."""
        last, clock = float("nan"), self.cell.clock
        while last != self.height_mm:
            last = self.height_mm
            clock.sleep(0.1)
        return last

    def join(self) -> None:
        """Wait for the other threads."""
        for thread in self._threads:
            thread.join(30)
            assert not thread.is_alive()


@contextmanager
def pressing(backend: str = "modbus-tcp") -> Iterator[Press]:
    """Serve a PLC and connect; whatever was begun has ended at the end."""
    with served(backend) as cell, cell.connect() as onlooker:
        controller = cell.connect()
        controller.motors(True)
        press = Press(cell, controller, onlooker)
        try:
            yield press
        finally:
            with suppress(RobolinkError):
                controller.close()
            press.join()


def stopped_soon(press: Press, at_mm: float) -> None:
    """Make sure that the tip stands, not far from where it was at the press."""
    assert abs(press.rests() - at_mm) < SOON_MM


@pytest.mark.fault("F76")
def test_a_stop_that_is_refused_for_a_moment_is_taken():
    with pressing() as press:
        at_mm = press.under_way()
        for number in range(8):
            press.fail(EXCEPTION, "STOP", on_exchange=number, code=BUSY)
        press.controller.stop()
        stopped_soon(press, at_mm)


@pytest.mark.fault("F76")
def test_a_stop_from_outside_that_is_refused_for_a_moment_is_taken():
    with pressing() as press:
        at_mm = press.under_way()
        refused = (("read_response", 4), ("write_command STOP", 8))
        for match, times in refused:
            for number in range(times):
                fault = PlcFault(EXCEPTION, on_exchange=number, match=match, code=BUSY)
                press.cell.simulator.faults.add(fault)
        assert not stop_now(press.cell.url).running
        stopped_soon(press, at_mm)


@pytest.mark.fault("F76")
@pytest.mark.parametrize("times", [1, 3])
def test_a_stop_that_was_written_and_got_lost_is_written_again(times):
    with pressing() as press:
        at_mm = press.under_way()
        for number in range(times):
            press.fail(LOST, "STOP", on_exchange=number)
        press.controller.stop()
        stopped_soon(press, at_mm)


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [EXCEPTION, LOST])
def test_where_no_stop_gets_through_nothing_is_kept_going_nor_by_the_end_of_the_session(how):
    with pressing() as press:
        at_mm = press.under_way()
        press.fail(how, "STOP", code=BUSY, **FOR_EVER)
        with pytest.raises(RobolinkError, match="emergency stop"):
            press.controller.stop()
        stopped_soon(press, at_mm)
        press.controller.close()
        press.join()
        stopped_soon(press, at_mm)


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [EXCEPTION, LOST])
def test_the_end_of_a_session_whose_stop_got_lost_stops_what_nobody_waits_on(how):
    with pressing() as press:
        press.begin()
        at_mm = press.height_mm
        for number in range(40):
            press.fail(how, "STOP", on_exchange=number, code=BUSY)
        with pytest.raises(RobolinkError, match="emergency stop"):
            press.controller.stop()
        press.cell.simulator.faults.clear()
        press.controller.close()
        stopped_soon(press, at_mm)
        assert press.cell.commands[-1] == "STOP"


@pytest.mark.fault("F76")
def test_a_stop_does_not_wait_behind_a_block_that_got_lost():
    with pressing() as press:
        at_mm = press.under_way()
        press.fail(LOST, "MOVE_LINEAR", **FOR_EVER)
        press.beside(press.begin)
        while press.cell.commands.count("MOVE_LINEAR") < 2:
            press.cell.clock.sleep(0.005)
        press.controller.stop()
        stopped_soon(press, at_mm)
        press.join()
        assert any(isinstance(end, OutcomeUnknownError) for end in press.ends)
        with pytest.raises(RobolinkError):  # behind the lost block nothing follows but stops
            press.controller.release_hold()


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [EXCEPTION, LOST])
def test_a_movement_that_is_given_up_is_stopped_where_no_halt_gets_through(how):
    with pressing() as press:
        motion = press.begin()
        at_mm = press.height_mm
        press.fail(how, "HALT", code=BUSY, **FOR_EVER)
        with pytest.raises(MotionTimeoutError):
            motion.wait(timeout_s=0.2)
        stopped_soon(press, at_mm)
        assert press.cell.commands[-1] == "STOP"


@pytest.mark.fault("F76")
@pytest.mark.parametrize("how", [EXCEPTION, LOST])
def test_a_movement_that_is_given_up_is_kept_going_by_nothing(how):
    """Neither halt nor stop gets through."""
    with pressing() as press:
        motion = press.begin()
        at_mm = press.height_mm
        press.fail(how, "HALT", code=BUSY, **FOR_EVER)
        press.fail(how, "STOP", code=BUSY, **FOR_EVER)
        with pytest.raises(RobolinkError):
            motion.wait(timeout_s=0.2)
        stopped_soon(press, at_mm)
