"""A look before a movement: what a person, a reset or another's answer does to it.

What is in force already is not set again, so all depends on the look: it is the newest, it is
this question's own, and after whatever puts power and speed back it is not believed.
"""

from dataclasses import replace

import pytest
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import execution
from robolink_simulators.epson.spel.expressions.print_format import joined
from robolink_simulators.faults import Fault, FaultAction

from robolink.controllers.epson.movement import Settings
from robolink.errors import NotReadyError, RemoteProtocolError, TransportClosedError
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from tests.contract._epson_wire_promises import SETS_BACK, sent, settings_in

pytestmark = [pytest.mark.simulator_only]

STRAIGHT = MotionProfile(Path.STRAIGHT, 5, 20.0)
COMMAS = ["numeric", "nothing"]


def lift(controller, dz_mm=0.5):
    group = controller.groups[0]
    here = group.pose()
    motion = group.move_to(replace(here, z_mm=here.z_mm + dz_mm), STRAIGHT, box=WorkBox())
    return motion.wait(timeout_s=60)


@pytest.fixture(params=COMMAS)
def served(request, serve):
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(comma_blank=request.param))
    simulator.machine.motors_on = True
    with serve(simulator) as cell, cell.connect() as controller:
        yield simulator, controller


def test_what_is_in_force_is_not_set_again_and_what_differs_is(served):
    simulator, controller = served
    assert lift(controller) is MotionOutcome.ARRIVED
    begun = len(simulator.log)
    lift(controller)
    assert settings_in(sent(simulator, begun)) == []
    for by_hand, expected in (
        ("Power High", ["Power Low"]),
        ("SpeedS 300", ["SpeedS 20.000"]),
        ("Speed 90", []),  # a straight movement does not go by it
        ("Power High; SpeedS 300; Speed 90", ["Power Low", "SpeedS 20.000"]),
    ):
        controller.execute_raw(by_hand)
        begun = len(simulator.log)
        lift(controller)
        assert settings_in(sent(simulator, begun)) == expected
        assert not simulator.machine.power_high


def test_the_tool_or_the_motors_that_changed_since_the_last_movement_stop_the_next(served):
    simulator, controller = served
    group = controller.groups[0]
    lift(controller)
    target = group.pose()
    moves = simulator.machine.arm.moves_started
    simulator.machine.tools.select(0)
    with pytest.raises(NotReadyError, match="tool 0 is selected"):
        group.move_to(target, STRAIGHT, box=WorkBox())
    simulator.machine.tools.select(1)
    simulator.machine.motors_on = False
    with pytest.raises(NotReadyError, match="motors are off"):
        group.move_to(target, STRAIGHT, box=WorkBox())
    assert simulator.machine.arm.moves_started == moves


@pytest.mark.parametrize("act", SETS_BACK)
def test_after_a_stop_a_reset_or_motor_on_all_is_set_anew_although_it_reads_right(served, act):
    simulator, controller = served
    lift(controller)
    begun = len(simulator.log)
    SETS_BACK[act](controller)
    controller.groups[0].settings.look()
    lift(controller)
    assert settings_in(sent(simulator, begun))[-3:] == ["Power Low", "Speed 5", "SpeedS 20.000"]


def test_a_stop_while_the_settings_are_confirmed_has_them_set_once_more(served, monkeypatch):
    simulator, controller = served
    settings, look = controller.groups[0].settings, Settings.look

    def stopped_meanwhile(self, edge=None):
        found = look(self, edge)
        controller.stop()
        controller.release_stop()
        return found

    with monkeypatch.context() as patch:
        patch.setattr(Settings, "look", stopped_meanwhile)
        settings.slow_down(STRAIGHT)
    begun = len(simulator.log)
    lift(controller)
    assert len(settings_in(sent(simulator, begun))) == 3


@pytest.mark.remote_ethernet  # an answer over Remote RS232 has another form
@pytest.mark.fault("F10")
@pytest.mark.parametrize("stray", [b"1 1 0 5 20 98", b"1 1 0 5 20", b"7", b"1 X: 1.000"])
def test_an_answer_to_another_look_is_recognized(serve, stray):
    """All looks ask for the same, so that the late answer to one would fit the next."""
    simulator = EpsonSimulator(seed=7)
    simulator.machine.motors_on = True
    with serve(simulator) as cell, cell.connect() as controller:
        lift(controller)
        target = controller.groups[0].pose()
        moves = simulator.machine.arm.moves_started
        simulator.push(b'#Execute,"%b\r\n"\r\n' % stray)
        with pytest.raises(RemoteProtocolError, match="did not ask for"):
            for _ in range(50):
                controller.groups[0].settings.look()
        with pytest.raises(TransportClosedError):
            controller.groups[0].move_to(target, STRAIGHT, box=WorkBox())
        assert simulator.machine.arm.moves_started == moves


@pytest.mark.fault("F10")
def test_the_answer_to_the_look_of_before_moves_nothing(serve):
    simulator = EpsonSimulator(seed=7)
    simulator.machine.motors_on = True
    with serve(simulator) as cell, cell.connect() as controller:
        lift(controller)
        target = controller.groups[0].pose()
        moves = simulator.machine.arm.moves_started
        controller.groups[0].settings.look()
        simulator.machine.power_high = True
        simulator.faults.add(Fault(FaultAction.REPEAT_REPLY, match="Print Tool, Motor"))
        with pytest.raises(RemoteProtocolError, match="did not ask for"):
            controller.groups[0].move_to(target, STRAIGHT, box=WorkBox())
        assert simulator.machine.arm.moves_started == moves


def test_a_list_that_this_controller_refuses_is_asked_for_value_by_value(serve, monkeypatch):
    def one_at_most(values, *rest, **more):
        if len(values) > 1:
            raise SpelRefusal(RefusalKind.FORMAT, "one item at most")
        return joined(values, *rest, **more)

    monkeypatch.setattr(execution, "joined", one_at_most)
    options = EpsonOptions(error_state_after_failed_execute=False)
    simulator = EpsonSimulator(seed=7, options=options)
    simulator.machine.motors_on = True
    with serve(simulator) as cell, cell.connect() as controller:
        assert lift(controller) is MotionOutcome.ARRIVED
        assert controller.groups[0].settings.look().motors_on
    assert '$Execute,"Print Motor"' in sent(simulator)
    assert not any("Motor, Power" in text for text in sent(simulator))
