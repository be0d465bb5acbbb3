"""Nothing that robolink does during production stops or disturbs it."""

import time
from contextlib import contextmanager
from itertools import count

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.testkit.media import served

import robolink
from robolink.errors import NotReadyError, ToolError, TransportError
from robolink.model import ControllerState, ToolOffset
from robolink.timing import Deadline, SystemClock

pytestmark = pytest.mark.simulator_only

S = 1_000_000_000

HABITS = [
    {},
    {"monitoring_timeout": "error"},
    {"monitoring_refusal": 11},
    {"logout_while_running": "refused"},
    {"second_client": "closed"},
    {"execute_on_disconnect": "stops"},
    {"extended_queries": False},
    {"rc_plus": 5},
    {"status_flags": 10},
    {"companion": False},
]

READS = {"Login", "GetStatus", "GetVariable", "GetCurRobot", "GetAlm", "GetRobotInfo"}
READS |= {"GetRobotSerial", "GetContVer", "GetContName", "GetContType", "GetContNo", "GetPrjName"}
READS |= {"GetContSettings"}


def in_production(options, **habit):
    """Return a controller that another device started, with a running task."""
    simulator = EpsonSimulator(seed=5, options=options(**habit))
    simulator.panel.set_monitoring_only(True)
    simulator.panel.start_production()
    return simulator


def requests(simulator):
    shown = (text for _, way, text in simulator.log if way == ">")
    return {text.removeprefix("$").partition(",")[0] for text in shown}


class SkippingClock(SystemClock):
    """Real time, from which a test can skip a part."""

    skipped_ns = 0

    def now_ns(self):
        return super().now_ns() + self.skipped_ns


class Cell:
    """A served simulator whose time can be advanced at once."""

    def __init__(self, url, simulator, skip):
        self.url = url
        self._simulator = simulator
        self._skip = skip

    def connect(self):
        return robolink.connect(self.url)

    def await_hang_up(self):
        """Wait until the controller has noticed that its client is gone."""
        deadline = Deadline.after(SystemClock(), 5.0)
        while self._simulator._slot.client is not None:
            assert not deadline.expired
            time.sleep(0.001)

    def pass_time(self, seconds):
        self._skip(seconds)
        with self._simulator.acting():
            pass  # which makes the device read its clock


@pytest.fixture(params=["sim", "tcp"])
def serve(request):
    """Makes such cells."""

    @contextmanager
    def offered(simulator):
        if request.param == "sim":
            clock = ManualClock()
            with served(simulator, clock=clock) as url:
                yield Cell(url, simulator, clock.advance)
            return
        base = SkippingClock()

        def skip(seconds):
            base.skipped_ns += seconds * S

        with serve_tcp(simulator, clock=ScaledClock(1.0, base)) as host:
            yield Cell(host.url, simulator, skip)

    return offered


def assert_undisturbed(simulator):
    assert simulator.condition.task is Task.RUNNING
    assert not simulator.condition.error
    assert simulator.condition.code == 0
    assert requests(simulator) <= READS


@pytest.mark.parametrize("habit", HABITS, ids=str)
def test_looking_disturbs_nothing_whatever_the_controller_s_habits(serve, options, habit):
    simulator = in_production(options, **habit)
    written = simulator.machine.flash_writes
    with serve(simulator) as cell:
        for _ in range(2):
            with cell.connect() as controller:
                assert controller.status().state is ControllerState.NOT_REMOTE
                controller.facts()
                published = controller.published_tools()
                assert (published is None) == (not simulator.options.companion)
                with pytest.raises(NotReadyError):
                    controller.tools.read_all()
                with pytest.raises(NotReadyError):
                    controller.tools.clear(1, expected=None)
            cell.await_hang_up()
            assert_undisturbed(simulator)
            cell.pass_time(1000)
            assert_undisturbed(simulator)
    assert simulator.machine.flash_writes == written


@pytest.mark.on_every_link
def test_an_idle_monitor_is_cut_off_and_production_goes_on(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell:
        with cell.connect() as controller:
            controller.published_tools()
            cell.pass_time(61)
            with pytest.raises(TransportError):
                controller.status()
        assert_undisturbed(simulator)
        with cell.connect() as controller:
            assert controller.published_tools() is not None
    assert_undisturbed(simulator)


def test_a_task_that_starts_between_the_last_look_and_the_end_is_not_logged_out_of(serve, options):
    simulator = EpsonSimulator(seed=5, options=options())
    simulator.panel.set_monitoring_only(True)
    with serve(simulator) as cell, cell.connect():
        simulator.on_reply = lambda number, text: simulator.panel.start_production()
    simulator.on_reply = None
    assert_undisturbed(simulator)


def test_a_client_in_control_is_not_logged_out_of_a_running_task_either(serve, options):
    simulator = EpsonSimulator(seed=5, options=options())
    with serve(simulator) as cell, cell.connect() as controller:
        simulator.panel.start_production()
        assert controller.status().state is ControllerState.RUNNING
        assert controller.published_tools() is not None
    assert_undisturbed(simulator)


def test_the_published_table_is_the_controller_s_own(serve, options):
    simulator = in_production(options)
    tip = ToolOffset(12.345678, -3.25, 1e-6, -90)
    with serve(simulator) as cell, cell.connect() as controller:
        first = controller.published_tools()
        assert (first.selected, first.robot, first.publication) == (1, 1, 1)
        assert first.tools == {tool: simulator.machine.tools.get(tool) for tool in range(1, 16)}
        with simulator.lock:
            simulator.machine.tools.set(15, tip)
            simulator.machine.tools.select(15)
        second = controller.published_tools()
        assert (second.selected, second.publication) == (15, 2)
        assert second.tools[15].matches(tip, 1e-9)
        assert controller.published_tools() == second


def test_what_was_published_stays_readable_when_production_has_ended(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell, cell.connect() as controller:
        during = controller.published_tools()
        simulator.panel.stop_production()
        assert controller.published_tools() == during


def test_a_project_that_has_not_published_yet_publishes_nothing(serve, options):
    with serve(EpsonSimulator(seed=5, options=options())) as cell, cell.connect() as controller:
        assert controller.published_tools() is None


def publishing(simulator, times):
    """Let the program change the table at each of its next readings."""
    left = count(times, -1)

    def change(number, text):
        if "robolink_tool" in text and next(left) > 0:
            with simulator.lock:
                x_mm = 20.0 + simulator.exchanges
                simulator.machine.tools.set(2, ToolOffset(x_mm))
                simulator.advance(simulator.now_ns)

    simulator.on_request = change


def test_a_torn_table_is_read_again(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell, cell.connect() as controller:
        publishing(simulator, 2)
        found = controller.published_tools()
        assert found.tools[2] == simulator.machine.tools.get(2)
        assert found.publication == 3


def test_a_table_that_never_stands_still_is_an_error(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell, cell.connect() as controller:
        publishing(simulator, 100)
        with pytest.raises(ToolError, match="changed during"):
            controller.published_tools()
        simulator.on_request = None
        assert controller.published_tools() is not None


def test_a_publication_that_was_broken_off_is_never_taken_for_a_whole_one(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell, cell.connect() as controller:
        controller.published_tools()
        simulator.variables.set("robolink_begin", "2")
        with pytest.raises(ToolError, match="changed during") as caught:
            controller.published_tools()
    assert "RobolinkPublish" in caught.value.remedy


def test_another_layout_of_the_table_is_refused(serve, options):
    simulator = in_production(options)
    with serve(simulator) as cell, cell.connect() as controller:
        controller.published_tools()
        simulator.variables.set("robolink_state(0)", "2")
        with pytest.raises(ToolError, match="layout 2"):
            controller.published_tools()
