"""A computer too busy to send heartbeats: the PLC halts, and a person may repeat the step."""

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes

from robolink.calibration_run import ChangePlan, Limits, NozzleChange, ToolPlan
from robolink.errors import ControllerFaultError, DeclinedError, HeartbeatLostError
from robolink.model import Path, WorkBox
from robolink.runner import Runner, RunSettings
from tests.contract._softmotion_cell import above, served

BUSY_S = 0.6


@pytest.fixture
def cell():
    with served("sim") as cell:
        yield cell


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        yield controller


class Person:
    """Answers every question alike after a delay; records the questions."""

    def __init__(self, answer):
        self.answer = answer
        self.asked = []

    def tell(self, text):
        """Accept a message."""

    def ask(self, question, kind):
        """Record a question."""
        self.asked.append(question)

    def poll(self, wait_s):
        """Answer, or leave."""
        if self.answer is None:
            raise DeclinedError("The input ended.", remedy="none")
        return self.answer


def be_busy(cell, *moves, meanwhile=lambda: None):
    """Keep this computer busy in the middle of these movements, counted from 1."""
    begun: list[str] = []
    busy: list[int] = []

    def on_request(_number, text):
        if text.startswith("write_command MOVE"):
            begun.append(text)
            busy[:] = [len(begun)] if not moves or len(begun) in moves else []
        elif text.startswith("read_") and busy and cell.simulator.plc.program.jobs.movements:
            busy.clear()
            cell.clock.advance(BUSY_S)
            meanwhile()

    cell.simulator.on_request = on_request
    return begun


def runner(controller, person, **options):
    box = WorkBox()
    options = {"repeats": True, **options}
    settings = RunSettings(box, speed_mm_s=2.0)
    return Runner(controller, controller.groups[0], person, settings, **options)


def test_a_step_is_repeated_to_the_same_place_when_a_person_says_so(cell, controller):
    person, begun = Person("y"), be_busy(cell, 1)
    target = above(controller.groups[0].pose(), 2.0)
    there = runner(controller, person).move(target, Path.STRAIGHT)
    assert there.coordinates() == pytest.approx(target.coordinates(), abs=1e-6)
    assert len(begun) == 2
    (question,) = person.asked
    assert "busy" in question
    assert "stopped the robot" in question
    assert cell.open_requests == []


@pytest.mark.parametrize("answer", ["n", "", "yes please", None])
def test_a_step_is_not_repeated_without_a_yes(cell, controller, answer):
    person, begun = Person(answer), be_busy(cell, 1)
    start = controller.groups[0].pose()
    with pytest.raises(HeartbeatLostError, match="701"):
        runner(controller, person).move(above(start, 2.0), Path.STRAIGHT)
    assert len(begun) == 1
    assert controller.groups[0].pose().z_mm - start.z_mm < 1.9
    assert cell.open_requests == []


def test_two_steps_of_a_procedure_are_repeated_and_no_third(cell, controller):
    person, begun = Person("y"), be_busy(cell)
    with pytest.raises(HeartbeatLostError):
        runner(controller, person).move(above(controller.groups[0].pose(), 9.0), Path.STRAIGHT)
    assert (len(begun), len(person.asked)) == (3, 2)


@pytest.mark.parametrize("options", [{"repeats": False}, {"offers": False}])
def test_nobody_is_asked_where_nothing_is_to_be_repeated(cell, controller, options):
    person = Person("y")
    be_busy(cell, 1)
    with pytest.raises(HeartbeatLostError):
        target = above(controller.groups[0].pose(), 2.0)
        runner(controller, person, **options).move(target, Path.STRAIGHT)
    assert person.asked == []


@pytest.mark.parametrize("change", ["tool", "permit", "power"])
def test_nobody_is_asked_when_the_cell_is_not_as_it_was(cell, controller, change):
    person, panel = Person("y"), cell.simulator.panel
    acts = {
        "tool": lambda: cell.simulator.plc.tools.forget(),
        "permit": panel.withdraw_permit,
        "power": panel.press_estop,
    }
    be_busy(
        cell, 1, meanwhile=lambda: cell.simulator.advance(cell.clock.now_ns()) or acts[change]()
    )
    with pytest.raises(ControllerFaultError, match="701"):
        target = above(controller.groups[0].pose(), 2.0)
        runner(controller, person).move(target, Path.STRAIGHT)
    assert person.asked == []


def calibrated(cell, controller):
    """Calibrate slot 1 as a person does who watches the tip and confirms everything."""
    said: list[str] = []
    limits = Limits(speed_percent=5, speed_mm_s=20.0)
    plan = ChangePlan((ToolPlan(1),), limits)
    operator = AssistedOperator.with_eyes(
        InProcessEyes(cell.simulator), said.append, clock=controller.clock
    )
    (report,) = NozzleChange(controller, plan, operator=operator).run().tools
    return report, said


def test_a_calibration_with_a_busy_moment_in_it_ends_as_without(cell, controller):
    first_long_way = 4
    begun = be_busy(cell, first_long_way)
    report, said = calibrated(cell, controller)
    assert sum("busy" in line for line in said) == 1
    assert len(begun) > first_long_way
    found, truth = controller.tools.read(1), cell.simulator.world.tips[1]
    assert (found.x_mm, found.y_mm) == pytest.approx((truth.x_mm, truth.y_mm), abs=0.05)
    assert report.verification is not None
    assert cell.open_requests == []


def test_a_busy_moment_while_the_new_value_is_proved_takes_it_back(cell, controller):
    before, changes = controller.tools.read(1), cell.slot_changes(1)
    be_busy_after_the_write(cell)
    with pytest.raises(HeartbeatLostError):
        calibrated(cell, controller)
    assert cell.slot_changes(1) == changes + 2
    assert controller.tools.same(controller.tools.read(1), before)
    assert cell.open_requests == []


def be_busy_after_the_write(cell):
    """Be busy during the movement that follows the first tool write."""
    seen = []

    def on_request(_number, text):
        if text.startswith("write_command"):
            seen.append(text.split()[1])
        elif text == "read_head" and "WRITE_TOOL" in seen and seen[-1].startswith("MOVE"):
            seen.clear()
            cell.clock.advance(BUSY_S)

    cell.simulator.on_request = on_request
