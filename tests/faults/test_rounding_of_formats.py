"""The rounding of a format is no difference, and the next number that it can hold is one."""

from contextlib import contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit import media

import robolink
from robolink import ToolOffset
from robolink.errors import ReadBackError
from tests.contract._softmotion_cell import served

LAST_DIGIT_MM = 0.001
"""The resolution of EPSON's text: three decimals."""
SLOT = 15


@contextmanager
def epson(simulator):
    with media.served(simulator) as url, robolink.connect(url) as controller:
        yield controller


@pytest.mark.fault("F36")
def test_f36_what_the_text_rounds_is_written_and_read_back_without_a_difference():
    @settings(max_examples=10, deadline=None)
    @given(st.floats(-300, 300), st.floats(-300, 300))
    def any_offset(x_mm, y_mm):
        wanted = ToolOffset(x_mm, y_mm, -20.0)
        controller.tools.write(2, wanted, expected=robolink.ANY)
        held = controller.tools.read(2)
        assert held is not None
        assert abs(held.x_mm - x_mm) <= LAST_DIGIT_MM / 2 + 1e-9
        assert abs(held.y_mm - y_mm) <= LAST_DIGIT_MM / 2 + 1e-9
        assert not controller.tools.same(held, ToolOffset(x_mm + 1.01 * LAST_DIGIT_MM, y_mm, -20))

    with epson(EpsonSimulator(seed=5)) as controller:
        any_offset()


@pytest.mark.fault("F36")
def test_f36_one_unit_of_the_last_digit_is_a_difference_that_is_found():
    old, new = ToolOffset(1, 2, 3), ToolOffset(1 + LAST_DIGIT_MM, 2, 3)
    simulator = EpsonSimulator(
        seed=5, faults=[Fault(FaultAction.IGNORE_WRITE, match="TLSet 2, XY")]
    )
    simulator.machine.tools.set(2, old)
    with epson(simulator) as controller, pytest.raises(ReadBackError):
        controller.tools.write(2, new, expected=old)


@pytest.mark.fault("F36")
def test_f36_a_plc_keeps_every_bit_and_a_nanometre_is_a_difference():
    old, new = ToolOffset(1 / 3, -2 / 3, 1e-3), ToolOffset(1 / 3 + 1e-6, -2 / 3, 1e-3)
    with served("sim", SoftMotionSimulator(seed=7)) as cell, cell.connect() as controller:
        controller.tools.write(SLOT, old, expected=None)
        held = controller.tools.read(SLOT)
        assert held is not None
        assert held.components() == pytest.approx(old.components(), abs=1e-12)
        ignored = PlcFault(PlcFaultAction.IGNORE_WRITE, match="write_command WRITE_TOOL")
        cell.simulator.faults.add(ignored)
        with pytest.raises(robolink.errors.RobolinkError):
            controller.tools.write(SLOT, new, expected=old)
        assert cell.simulator.faults.fired == [ignored]
