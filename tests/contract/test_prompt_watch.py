"""The prompt polls the controller while it waits for a person."""

from itertools import pairwise

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import clock_of, register, unregister

import robolink
from robolink.errors import ControllerFaultError, TransportError
from robolink.model import WorkBox
from robolink.runner import Runner, RunSettings, ask_for_pose
from robolink.timing import NS_PER_S

HALF_AN_HOUR_S = 30 * 60
NAME = "prompt-watch"


class SlowOperator:
    """A person who answers after ``thinks_s``; ``meanwhile`` runs after ``happens_at_s``."""

    def __init__(self, clock, thinks_s, *, meanwhile=None, happens_at_s=0.0):
        self._clock = clock
        self._thinks_s = thinks_s
        self._meanwhile = meanwhile
        self._happens_at_s = happens_at_s
        self._asked_ns = 0
        self.happened_ns = None

    def tell(self, text):
        pass

    def ask(self, question, kind):
        self._asked_ns = self._clock.now_ns()

    def poll(self, wait_s):
        self._clock.sleep(wait_s)
        passed_s = (self._clock.now_ns() - self._asked_ns) / NS_PER_S
        due = self.happened_ns is None and passed_s >= self._happens_at_s
        if self._meanwhile is not None and due:
            self.happened_ns = self._clock.now_ns()
            self._meanwhile()
        return "done" if passed_s >= self._thinks_s else None


class DeafOperator(SlowOperator):
    """A prompt that cannot be interrupted, such as ``input()``."""

    def poll(self, wait_s):
        return super().poll(self._thinks_s)


@pytest.fixture
def simulator():
    """A controller with the default remote time-out of 60 s."""
    simulator = EpsonSimulator(seed=3)
    assert simulator.options.remote_timeout_s == 60.0
    register(NAME, simulator)
    yield simulator
    unregister(NAME)


@pytest.fixture
def controller(simulator):
    with robolink.connect(simulator.url) as controller:
        yield controller


def ask(controller, operator):
    group = controller.groups[0]
    runner = Runner(controller, group, operator, RunSettings(WorkBox()))
    return runner.run(ask_for_pose("Jog the tip onto the pin."))


def test_30_virtual_minutes_at_a_prompt_keep_the_session(simulator, controller):
    clock = clock_of(NAME)
    began_ns = clock.now_ns()
    pose = ask(controller, SlowOperator(clock, HALF_AN_HOUR_S))
    assert clock.now_ns() - began_ns >= HALF_AN_HOUR_S * NS_PER_S
    assert pose.tool == 1
    assert controller.status().ready
    assert not simulator.condition.error


@pytest.mark.fault("F75")
def test_the_status_goes_out_at_least_every_5_s(simulator, controller):
    ask(controller, SlowOperator(clock_of(NAME), HALF_AN_HOUR_S))
    asked_ns = [now_ns for now_ns, _, text in simulator.log if text == "$GetStatus"]
    gaps_s = [(after - before) / NS_PER_S for before, after in pairwise(asked_ns)]
    assert len(gaps_s) > 300
    assert max(gaps_s) <= 5.0


def test_a_prompt_that_is_not_polled_would_lose_the_session(controller):
    with pytest.raises(TransportError):
        ask(controller, DeafOperator(clock_of(NAME), HALF_AN_HOUR_S))


@pytest.mark.parametrize(
    ("danger", "words"),
    [
        ("press_estop", "The emergency stop was pressed. The job has ended"),
        ("open_guard", "The safety guard was opened. The job has ended"),
    ],
)
def test_e_stop_and_guard_show_within_one_poll(simulator, controller, danger, words):
    clock = clock_of(NAME)
    operator = SlowOperator(
        clock, HALF_AN_HOUR_S, meanwhile=getattr(simulator.panel, danger), happens_at_s=600.0
    )
    with pytest.raises(ControllerFaultError, match=words):
        ask(controller, operator)
    assert operator.happened_ns is not None
    assert clock.now_ns() - operator.happened_ns <= NS_PER_S


def test_an_e_stop_at_the_prompt_of_a_procedure_names_the_tool_that_is_left(simulator, controller):
    operator = SlowOperator(clock_of(NAME), 60.0, meanwhile=simulator.panel.press_estop)
    with pytest.raises(ControllerFaultError, match="could not select the previous tool 1 again"):
        with controller.preserved("calibrate tool 1"):
            controller.tools.select(0)
            ask(controller, operator)
    (marker,) = controller.outcomes.open_markers()
    assert (marker.details["tool"], marker.details["now"]) == (1, 0)
