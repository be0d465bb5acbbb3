"""Nozzle and pin as a switch: a controller input that the driver reads like any other."""

from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes, perform
from robolink_simulators.hosting.in_process import epson, softmotion

import robolink
from robolink.errors import ConfigError, NotReadyError
from robolink.model import InputEdge, Pose, WorkBox
from robolink.runner import Runner, RunSettings, ask_for_pose

INPUT = 7
HOSTS = {"epson": epson, "softmotion": softmotion}
ANYWHERE = WorkBox()
LATE_MM = 0.1
"""Braking distance, or one cycle of the PLC."""


@contextmanager
def wired_cell(kind, **world):
    """Yield a controller and its simulator, with nozzle and pin wired to an input."""
    wanted = {"contact_input": INPUT, "eye_sigma_mm": 0.01, **world}
    options = "&".join(f"world.{name}={value}" for name, value in wanted.items())
    name = f"contact-{kind}"
    try:
        with robolink.connect(f"{kind}+sim://{name}?seed=3&{options}") as controller:
            controller.motors(True)
            controller.tools.select(0)
            yield controller, HOSTS[kind].simulator_named(name)
    finally:
        HOSTS[kind].unregister(name)


@pytest.fixture(params=HOSTS)
def cell(request):
    with wired_cell(request.param) as both:
        yield both


def carry(simulator, by_mm):
    """Carry the tip to another place."""
    with simulator.lock:
        world = simulator.world
        world.robot.carry(world.tips[1], by_mm)


def over_the_pin(simulator, beside_mm=0.0, above_mm=2.0):
    """Bring the tip above the pin, or beside it."""
    dx, dy, dz = simulator.world.gap_mm()
    carry(simulator, (dx + beside_mm, dy, dz + above_mm))


def seek_down(controller, by_mm=3.0):
    """Move down until the input switches on; return the pose, or ``None`` if it did not."""
    group = controller.groups[0]
    here = group.pose()
    target = replace(here, z_mm=here.z_mm - by_mm)
    edge = InputEdge(INPUT)
    return group.move_until_input(target, edge, speed_mm_s=5.0, box=ANYWHERE).wait(timeout_s=30)


def test_the_input_is_on_while_the_tip_touches_the_pin_and_only_then(cell):
    controller, simulator = cell
    for beside_mm, above_mm, on in (
        (0.0, 0.01, False),
        (0.0, -0.01, True),
        (0.2, -0.5, True),
        (0.3, -0.5, False),
        (0.0, 3.0, False),
    ):
        over_the_pin(simulator, beside_mm, above_mm)
        assert controller.io.read_input(INPUT) is on
        assert controller.io.read_input(INPUT + 1) is False


def test_a_movement_stops_at_the_contact(cell):
    controller, simulator = cell
    over_the_pin(simulator)
    contact_mm = controller.groups[0].pose().z_mm - 2.0
    found = seek_down(controller)
    assert isinstance(found, Pose)
    assert found.z_mm == pytest.approx(contact_mm, abs=LATE_MM)
    assert controller.io.read_input(INPUT)
    stands_mm = controller.groups[0].pose().z_mm
    with pytest.raises(NotReadyError, match="Input 7 is on before the movement begins"):
        seek_down(controller)
    assert controller.groups[0].pose().z_mm == pytest.approx(stands_mm, abs=0.005)


def test_a_movement_beside_the_pin_finds_nothing(cell):
    controller, simulator = cell
    over_the_pin(simulator, beside_mm=0.4)
    assert seek_down(controller) is None


@pytest.mark.parametrize("kind", ["epson", pytest.param("softmotion", marks=pytest.mark.soak)])
def test_a_person_who_jogs_onto_the_pin_switches_it_each_time(kind):
    with wired_cell(kind, eye_sigma_mm=0.03, pin_bumped_after_touch=2, pin_bump_mm=2) as both:
        controller, simulator = both
        person = AssistedOperator.with_eyes(InProcessEyes(simulator), lambda _: None)
        runner = Runner(controller, controller.groups[0], person, RunSettings(box=ANYWHERE))
        for _ in range(6):
            carry(simulator, (0.9, 0.3, 3.0))
            assert controller.io.read_input(INPUT) is False
            runner.run(ask_for_pose("Jog the tip onto the pin."))
            assert controller.io.read_input(INPUT) is True


@pytest.mark.parametrize("kind", HOSTS)
def test_who_only_presses_enter_does_not_switch_it(kind):
    with wired_cell(kind, person_stays_share=1) as (controller, simulator):
        person = AssistedOperator.with_eyes(InProcessEyes(simulator), lambda _: None)
        runner = Runner(controller, controller.groups[0], person, RunSettings(box=ANYWHERE))
        runner.run(ask_for_pose("Jog the tip onto the pin."))
        assert controller.io.read_input(INPUT) is False


def test_it_is_wired_to_another_input_or_taken_off_while_the_cell_is_there(cell):
    controller, simulator = cell
    over_the_pin(simulator, above_mm=-0.01)
    perform(simulator, {"do": "set_world", "contact_input": 9})
    assert [controller.io.read_input(number) for number in (INPUT, 9)] == [False, True]
    perform(simulator, {"do": "set_world", "lean_deg": 1})
    assert controller.io.read_input(9)
    perform(simulator, {"do": "set_world", "contact_input": None})
    assert not controller.io.read_input(9)


def test_an_input_that_the_controller_lacks_is_refused_and_nothing_is_changed(cell):
    controller, simulator = cell
    over_the_pin(simulator, above_mm=-0.01)
    before = simulator.world.truth()
    with pytest.raises(ConfigError, match="no input 512"):
        perform(simulator, {"do": "set_world", "contact_input": 512, "lean_deg": 2})
    assert simulator.world.truth() == before
    assert controller.io.read_input(INPUT)
