import random

import pytest
from robolink_simulators.epson.arm.coordinate_systems import Local
from robolink_simulators.epson.arm.motion_parameters import MotionParameters
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.memory.points import Point

from robolink.model import ToolOffset

T6 = find_robot("T6-602S")
NOZZLE = ToolOffset(12.0, -3.0, -20.0, 30.0)


@pytest.fixture
def machine():
    return Machine(T6)


def test_the_selected_tool_moves_the_reported_tip_but_not_the_arm(machine):
    flange = machine.tip()
    machine.tools.set(2, NOZZLE)
    machine.tools.select(2)
    tip = machine.tip()
    # The arm rests with U = 0, so the offset adds up axis by axis.
    added = [a - b for a, b in zip(tip.coordinates(), flange.coordinates(), strict=True)]
    assert added == pytest.approx(NOZZLE.components())
    assert tip.tool == 2
    assert machine.arm.moves_started == 0


def test_the_joints_for_a_point_bring_the_selected_tip_there(machine):
    machine.tools.set(2, NOZZLE)
    machine.tools.select(2)
    machine.locals.define(1, Local(10.0, 20.0, -5.0, 30.0))
    target = machine.locals.convert(Point((200.0, 380.0, -60.0, 25.0, 0.0, 0.0)), 1)
    machine.arm.place(machine.robot.joints_for(target), 0)
    assert machine.tip().coordinates() == pytest.approx((200.0, 380.0, -60.0, 25.0, 0.0, 0.0))


def test_an_undefined_tool_cannot_be_selected(machine):
    with pytest.raises(SpelRefusal) as refused:
        machine.tools.select(5)
    assert refused.value.kind is RefusalKind.TOOL_UNDEFINED
    assert machine.tools.selected == 0


@pytest.mark.parametrize(
    ("tool", "kind"),
    [
        (0, RefusalKind.TOOL_ZERO_FIXED),
        (16, RefusalKind.TOOL_NUMBER),
        (-1, RefusalKind.TOOL_NUMBER),
    ],
)
def test_only_tools_1_to_15_can_be_written(machine, tool, kind):
    for write in (lambda: machine.tools.set(tool, NOZZLE), lambda: machine.tools.clear(tool)):
        with pytest.raises(SpelRefusal) as refused:
            write()
        assert refused.value.kind is kind
    assert machine.flash_writes == 0


def test_every_write_and_clear_wears_the_flash(machine):
    machine.tools.set(1, NOZZLE)
    machine.tools.set(1, NOZZLE)
    machine.tools.clear(1)
    machine.tools.select(0)
    assert machine.flash_writes == 3


def test_clearing_the_tool_in_force_is_an_error_or_selects_the_flange(machine):
    machine.tools.set(1, NOZZLE)
    machine.tools.select(1)
    with pytest.raises(SpelRefusal) as refused:
        machine.tools.clear(1)
    assert refused.value.kind is RefusalKind.TOOL_IN_FORCE
    assert (machine.tools.selected, machine.tools.get(1)) == (1, NOZZLE)
    machine.tools.clear(1, in_force="selects_zero")
    assert machine.tools.selected == 0


def test_motor_on_resets_the_motion_parameters_and_power(machine):
    machine.parameters = MotionParameters(speed=(50, 50, 50), limz_mm=-20.0)
    machine.power_high = True
    machine.switch_motors(True)
    assert machine.motors_on
    assert not machine.power_high
    assert machine.parameters == MotionParameters()


def test_the_measured_tip_is_that_of_the_selected_tool(machine):
    machine.tools.set(1, NOZZLE)
    machine.tools.select(1)
    assert machine.robot.real_tip(random.Random(1), 0.0) == machine.tip()


def test_a_byte_is_eight_bits_with_the_lowest_first():
    bank = BitBank(16)
    bank.set_byte(1, 0b101)
    assert [bank.get(n) for n in range(8, 12)] == [True, False, True, False]
    bank.set(15, True)
    assert bank.get_byte(1) == 0b1000_0101
    bank.clear()
    assert bank.get_byte(1) == 0


@pytest.mark.parametrize(
    "use",
    [
        lambda bank: bank.get(16),
        lambda bank: bank.set(-1, True),
        lambda bank: bank.get_byte(2),
        lambda bank: bank.set_byte(0, 256),
    ],
)
def test_a_bit_or_a_value_that_does_not_exist_is_refused(use):
    with pytest.raises(SpelRefusal):
        use(BitBank(16))
