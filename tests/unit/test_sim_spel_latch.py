"""SetLatch, LatchEnable, LatchState and LatchPos (docs/reference/spel.md 7.1)."""

import pytest

from tests.unit.test_sim_spel_base import Cell
from tests.unit.test_sim_spel_points import NUMBERS

PLATE_MM, HOLE_MM = -20.0, -30.0


@pytest.fixture
def window():
    """A window whose input 24 is on while the flange is in a band of heights."""
    window = Cell()
    arm = window.machine.arm

    def touches(instant_ns):
        flange = arm.true_flange() if instant_ns is None else arm.true_flange_at(instant_ns)
        return HOLE_MM < flange.z_mm <= PLATE_MM

    window.machine.inputs.connect(24, touches)
    window("SpeedS 20")
    return window


def height(window, asked="LatchPos"):
    return float(window(f"Print CZ({asked})"))


def test_the_place_of_the_first_edge_is_latched_though_nobody_looks_and_nothing_stops(window):
    window("SetLatch 24, SETLATCH_TRIGGERMODE_LEADINGEDGE; LatchEnable On")
    assert window("LatchEnable; Print LatchState") == "ON\r\n0\r\n"
    assert window.error("Print CZ(LatchPos)") == NUMBERS.point_undefined
    window("Move Here :Z(-50) Find Sw(24) = On")
    assert window("Print LatchState") == "-1\r\n"
    assert height(window) == pytest.approx(PLATE_MM, abs=1e-4)
    assert height(window, "FindPos") == pytest.approx(height(window), abs=1e-4)
    assert height(window, "Here") == pytest.approx(-50, abs=1e-6)
    window("Move Here :Z(0)")
    assert height(window) == pytest.approx(PLATE_MM, abs=1e-4)  # the first edge alone
    window("LatchEnable Off; LatchEnable On; Move Here :Z(-25); LatchEnable Off")
    assert height(window) == pytest.approx(PLATE_MM, abs=1e-4)


def test_the_other_edge_and_several_of_them(window):
    window("SetLatch SETLATCH_PORT_CU_0, SETLATCH_TRIGGERMODE_TRAILINGEDGE, 3; LatchEnable On")
    window("Move Here :Z(-50)")
    assert window("Print LatchState") == "0\r\n"  # one of three
    assert height(window) == pytest.approx(HOLE_MM, abs=1e-4)
    window("Move Here :Z(0); Move Here :Z(-50); Move Here :Z(0)")
    assert window("Print LatchState") == "-1\r\n"
    taken = [height(window, f"LatchPos(WithoutToolArm, {n})") for n in (1, 2, 3)]
    assert taken == pytest.approx([HOLE_MM, PLATE_MM, HOLE_MM], abs=1e-4)
    assert window.error("P1 = LatchPos(0, 4)") == NUMBERS.point_undefined


def test_the_tool_is_that_of_the_question_not_of_the_edge(window):
    window("SetLatch 24, 1; LatchEnable On; TLSet 1, XY(10, 0, -7, 0); Move Here :Z(-50)")
    assert height(window) == pytest.approx(PLATE_MM, abs=1e-4)
    window("Tool 1")
    assert height(window) == pytest.approx(PLATE_MM - 7, abs=1e-4)
    assert height(window, "LatchPos(WithoutToolArm)") == pytest.approx(PLATE_MM, abs=1e-4)
    window("Base XY(0, 0, 100, 0)")
    assert height(window) == pytest.approx(PLATE_MM - 107, abs=1e-4)


def test_an_input_that_is_switched_by_hand_latches_too(window):
    window("SetLatch 25, 1; LatchEnable On")
    inputs = window.machine.inputs
    inputs.set(26, on=True)
    assert window("Print LatchState") == "0\r\n"
    inputs.set(25, on=True)
    at = height(window, "Here")
    assert window("Print LatchState") == "-1\r\n"
    window("Move Here :Z(-10)")
    assert height(window) == pytest.approx(at)
    # On already when it is enabled: no edge until it was off.
    window("LatchEnable Off; LatchEnable On")
    inputs.set(25, on=True)
    assert window("Print LatchState") == "0\r\n"
    inputs.set(25, on=False)
    inputs.set(25, on=True)
    assert height(window) == pytest.approx(-10, abs=1e-6)


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("LatchEnable On", NUMBERS.latch_unset),
        ("SetLatch 23, 1", NUMBERS.io_bit),
        ("SetLatch 24, 2", NUMBERS.value_out_of_range),
        ("SetLatch 24, 1, 5", NUMBERS.value_out_of_range),
        ("SetLatch 24", NUMBERS.syntax),
        ("Print LatchPos(2)", NUMBERS.value_out_of_range),
        ("LatchState", NUMBERS.function_only),
    ],
)
def test_what_latches_nothing_is_refused(window, statement, number):
    assert window.error(statement) == number
    assert not window.machine.robot.latch.enabled


def test_a_restart_forgets_what_was_set(window):
    window("SetLatch 24, 1; LatchEnable On")
    window.machine.forget_volatile(window.now_ns)
    assert not window.machine.robot.latch.enabled
    assert window.error("LatchEnable On") == NUMBERS.latch_unset
