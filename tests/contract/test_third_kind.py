"""A third-party controller kind, from its URL to a calibrated tool."""

from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints

import pytest

import robolink
from robolink import ToolOffset
from robolink.calibration_run import AcceptanceCriteria, ChangePlan, NozzleChange, ToolPlan
from robolink.controllers import CONTROLLERS_GROUP, SimpleController, SimpleMachine, stop_now
from robolink.errors import ConfigError, ConnectError, RejectedError
from robolink.methods import TwoPoseSource
from robolink.runner import Question
from robolink.testing import (
    ContractBrokenError,
    Subject,
    check_controller,
)
from robolink.timing import FASTEST_ANSWER_S
from tests.contract.third_kind import BenchServer, open_bench

TRUE = ToolOffset(12.4, -3.2, -20.0)
"""The tip of the new nozzle; the old one was at the server's value."""

PIN_MM = (312.0, -3.5, 80.0)


class Installed(EntryPoint):
    """An entry point of an installed package."""

    def load(self):
        if self.value == "gone:opener":
            raise ImportError("no module named 'gone'")
        if self.value == "crude:module":
            raise RuntimeError("no dongle")
        return crude_opener if self.value == "crude:opener" else open_bench


def crude_opener(url, terms):
    raise KeyError("dongle")


def install(monkeypatch, *entries):
    group = EntryPoints([Installed(name, value, CONTROLLERS_GROUP) for name, value in entries])
    whole = metadata.entry_points
    monkeypatch.setattr(
        metadata,
        "entry_points",
        lambda **by: group.select(**by) if by.get("group") == CONTROLLERS_GROUP else whole(**by),
    )


@pytest.fixture
def server():
    with BenchServer() as server:
        yield server


class Fitter:
    """Reads the question, brings the tip to the pin, and confirms."""

    def __init__(self, machine, clock):
        self.machine, self.clock = machine, clock
        self.places = self.reads = False

    def tell(self, text):
        pass

    def ask(self, question, kind):
        self.places = kind is Question.PLACE
        self.reads = True

    def poll(self, wait_s):
        if self.reads:
            self.reads = False
            self.clock.sleep(1.2 * FASTEST_ANSWER_S)
        if not self.places:
            return "y"
        tip = self.machine.tip(TRUE)
        away = [at - there for at, there in zip(PIN_MM, tip.coordinates(), strict=False)]
        if max(map(abs, away)) > 0.1:
            away[2] += 0.05  # the last step is a fine one
        steps = [round(max(-4.0, min(4.0, step)), 3) for step in away]
        return " ".join(
            f"{axis}{step:+.3f}" for axis, step in zip("xyz", steps, strict=True) if step
        )


@pytest.mark.parametrize("name", ["bench", "bench+tcp"])
def test_an_entry_point_leads_from_its_url_to_it(server, monkeypatch, name):
    install(monkeypatch, (name, "bench_package.bench_controller:open_bench"))
    with robolink.connect(server.url) as controller:
        assert controller.tools.read(1) == ToolOffset(12.0, -3.5, -20.0)
        assert controller.identity == server.url
    server.machine.go(server.machine.tip(ToolOffset()))
    assert stop_now(server.url).ready
    assert "HALT" in server.asked


def test_a_kind_that_keeps_to_no_acceleration_is_read_and_never_moved(server, monkeypatch):
    install(monkeypatch, ("bench", "bench_package.bench_controller:open_bench"))
    with pytest.raises(ConfigError, match="cannot limit the acceleration") as refusal:
        robolink.connect(server.url, acceleration_mm_s2=150)
    assert "acceleration_mm_s2" in refusal.value.remedy
    with robolink.connect(server.url, acceleration_mm_s2=150, glance=True) as controller:
        assert controller.tools.read(1) == ToolOffset(12.0, -3.5, -20.0)


def test_what_nobody_brings_or_cannot_be_loaded_is_said(server, monkeypatch):
    with pytest.raises(ConfigError, match="'bench'"):
        robolink.connect(server.url)
    install(monkeypatch, ("bench", "gone:opener"))
    with pytest.raises(ConfigError, match="no module named 'gone'"):
        robolink.connect(server.url)
    # Its errors are reported as its own, not as a defect of robolink.
    install(monkeypatch, ("bench", "crude:module"))
    with pytest.raises(ConfigError, match="cannot be loaded: RuntimeError: no dongle"):
        robolink.connect(server.url)
    install(monkeypatch, ("bench", "crude:opener"))
    with pytest.raises(ConfigError, match="connects to 'bench' failed: KeyError: 'dongle'"):
        robolink.connect(server.url)


def test_no_entry_point_is_looked_for_where_the_kind_is_our_own(monkeypatch):
    monkeypatch.setattr(metadata, "entry_points", None)
    with pytest.raises(ConnectError):
        robolink.connect("epson+tcp://127.0.0.1:9", timeout_s=0.2)


def test_a_controller_that_is_open_is_taken_for_its_url():
    with SimpleController() as controller:
        assert robolink.connect(controller) is controller
        assert stop_now(controller).ready
        assert controller.latch.closed


def test_a_tool_of_it_is_calibrated_at_two_poses(server, monkeypatch):
    install(monkeypatch, ("bench", "bench_package.bench_controller:open_bench"))
    server.machine.selected = 1
    server.machine.go(server.machine.tip(server.machine.tool))
    with robolink.connect(server.url) as controller:
        plan = ToolPlan(1, TwoPoseSource(), AcceptanceCriteria(), verify=True)
        change = NozzleChange(
            controller, ChangePlan((plan,)), operator=Fitter(server.machine, controller.clock)
        )
        change.run()
        written = controller.tools.read(1) or ToolOffset()
        assert controller.tools.selected() == 1
        assert not controller.outcomes.open_markers()
    assert written.x_mm == pytest.approx(TRUE.x_mm, abs=0.01)
    assert written.y_mm == pytest.approx(TRUE.y_mm, abs=0.01)


def test_a_controller_that_writes_what_it_likes_does_not_keep_its_promises():
    class Careless(SimpleMachine):
        """Stores every tool with a small error."""

    machine = Careless(tools={1: ToolOffset(1.0)})
    store = dict.__setitem__

    class Off(dict[int, ToolOffset]):
        def __setitem__(self, tool, offset):
            store(self, tool, ToolOffset(offset.x_mm + 0.25))

    machine.tools = Off(machine.tools)
    with pytest.raises(ContractBrokenError, match="a_write_is_read_back"):
        check_controller(Subject(lambda: SimpleController(machine)))


def test_a_machine_that_does_not_tell_which_tool_is_in_force_selects_none():
    machine = SimpleMachine(tools={1: ToolOffset(1.0)})
    machine.selected = None  # type: ignore[assignment]
    with SimpleController(machine) as controller:
        with pytest.raises(RejectedError, match="does not report"):
            controller.tools.select(1)
        with controller.preserved("a procedure"):
            controller.tools.write(1, ToolOffset(2.0), expected=ToolOffset(1.0))
        assert not controller.outcomes.open_markers()


def test_the_whole_suite_passes_on_a_controller_in_memory():
    machine = SimpleMachine()
    check_controller(Subject(lambda: SimpleController(machine)))
