"""``calibrate pivot`` live, on a PLC whose flange tilts; and robots that cannot tilt."""

from dataclasses import replace
from functools import partial

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Limits,
    Listener,
    NozzleChange,
    ToolPlan,
    flange_now,
)
from robolink.errors import ConfigError, VerifyError
from robolink.journal import memory_journal
from robolink.methods import PivotSource, informative_tilts
from robolink.model import EntryKind, Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.runner import Ask
from tests._commands import run_command
from tests.contract._method_cell import method_cell
from tests.contract._softmotion_cell import served

pytestmark = pytest.mark.simulator_only

FIVE = "Kin_5Axes"
STORED = (12.0, -3.5, -20.0)
QUICK = Limits(speed_percent=100, speed_mm_s=2000.0)


@pytest.fixture
def plc(serve_simulator, monkeypatch):
    """A simulated five-axis machine, in this process; ``url`` is its URL.

    It moves faster than commands allow, which only shortens the test.
    """
    monkeypatch.setattr("robolink.calibration_run.Limits", partial(Limits, speed_percent=100))
    simulator = SoftMotionSimulator(FIVE, seed=4)
    serve_simulator(simulator)
    return simulator


def run(url, *words):
    """Run a command; return its exit code, document and messages."""
    ended = run_command("-c", url, *words, "--json")
    return ended.code, ended.document, ended.err


def slot(simulator, number=1):
    """Return the lengths in the PLC's tool slot."""
    return simulator.plc.memory.slot(number).tool[:3]


def eyes(simulator, clock):
    return AssistedOperator.with_eyes(InProcessEyes(simulator), lambda _text: None, clock=clock)


def change(controller, simulator, *, listener=None, verify=True):
    source = PivotSource(informative_tilts(2, 20.0), TouchPlan())
    one = ToolPlan(1, source, AcceptanceCriteria(), verify=verify)
    plan = ChangePlan((one,), QUICK, ask_before_write=False)
    return NozzleChange(
        controller, plan, operator=eyes(simulator, controller.clock), listener=listener
    )


def test_a_pivot_finds_the_whole_tip_writes_it_and_proves_it_in_all_directions(plc, tmp_path):
    """The start is already tilted, and the tool has angles of its own."""
    group, world, page = plc.plc.group, plc.world, tmp_path / "page.html"
    group.place((*group.values[:4], 12.0))
    tip = world.tip_mm()
    world.pin_mm = (tip[0] + 3.0, tip[1] - 3.0, tip[2] - 4.0)
    offset = ("--x", "12", "--y", "-3.5", "--z", "-20", "--u", "15", "--v", "8", "--w", "-5")
    assert run(plc.url, "tool", "set", "1", *offset, "--yes")[0] == 0
    words = ("calibrate", "pivot", "--tool", "1", "--assist", plc.url, "--yes", "--speed", "100")
    more = ("--count", "4", "--station", "PIN-01", "--report", str(page))
    code, document, said = run(plc.url, *words, *more)
    assert code == 0, said
    assert document["measured"] == ["x_mm", "y_mm", "z_mm"]
    assert document["proposed"]["v_deg"] == pytest.approx(8.0)
    truth, half = world.tips[1].components()[:3], document["fit"]["half_width95"].values()
    for found, true, width in zip(slot(plc), truth, half, strict=True):
        assert abs(found - true) < 4 * width
    assert max(half) < 0.3
    assert "4 touches agree within" in said
    assert document["verification"]["passed"]
    assert all(abs(drift["dz_mm"]) < 0.1 for drift in document["verification"]["drifts"])
    assert "dZ mm" in page.read_text()
    assert group.values[4] == pytest.approx(12.0, abs=1e-6), "as it stood before"
    (pin,) = memory_journal(plc.url).entries(kinds=[EntryKind.STATION])
    place = [pin.details[name] for name in ("x_mm", "y_mm", "z_mm")]
    assert place == pytest.approx(world.pin_mm, abs=0.1)


def test_a_tip_that_slips_after_the_measurement_is_found_and_the_old_value_comes_back():
    class Slips(Listener):
        def wrote(self, receipt):
            tip = simulator.world.tips[1]
            simulator.world.tips[1] = replace(tip, z_mm=tip.z_mm - 1.0)

    simulator = SoftMotionSimulator(FIVE, seed=4)
    with served("sim", simulator) as cell, cell.connect() as controller:
        with pytest.raises(VerifyError):
            change(controller, simulator, listener=Slips()).run()
        assert simulator.plc.group.values[4] == pytest.approx(0.0, abs=1e-6)
    assert slot(simulator) == STORED


def test_a_dry_run_shows_each_tilt_and_sends_nothing(plc):
    words = ("calibrate", "pivot", "--tool", "1", "--dry-run", "--count", "5", "--tilt", "15")
    code, document, said = run(plc.url, *words)
    assert code == 0, said
    steps = document["steps"]
    assert sum("onto the pin" in step["text"] for step in steps) == 5
    leaning = {round(step["target"]["v_deg"], 3) for step in steps if step["target"]}
    assert {-15.0, 0.0, 15.0} <= leaning
    assert all(step["requests"] for step in steps if step["target"])
    assert not any(step["refusal"] for step in steps)
    assert plc.plc.group.movements_started == 0
    assert slot(plc) == STORED


@pytest.mark.parametrize(
    ("words", "code", "what"),
    [
        (("--tool", "1", "--box", "1", "--yes"), 2, "would leave the allowed area"),
        (("--tool", "2", "--yes"), 2, "The tool is not defined"),
        (("--tool", "1", "--until", "1", "--pose", "1,2,3,4,5,6"), 2, "is for movements"),
        (("--tool", "1"), 9, ""),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(plc, words, code, what):
    ended, document, _ = run(plc.url, "calibrate", "pivot", *words)
    assert ended == code, document
    assert what in document["error"]["what"]
    assert plc.plc.group.movements_started == 0
    assert slot(plc) == STORED


def test_ctrl_c_in_a_tilt_puts_the_tool_back_and_writes_nothing():
    class Leaves(Listener):
        touches = 0

        def step(self, tool, done):
            self.touches += isinstance(done.step, Ask)
            if self.touches == 2:
                raise KeyboardInterrupt

    simulator = SoftMotionSimulator(FIVE, seed=4)
    with served("sim", simulator) as cell, cell.connect() as controller:
        with pytest.raises(KeyboardInterrupt):
            change(controller, simulator, listener=Leaves()).run()
        assert controller.tools.selected() == 1
        assert controller.groups[0].pose().tool == 1
        assert abs(simulator.plc.group.values[4]) == pytest.approx(20.0)
        # The next command finds the flange of a machine that stands tilted.
        flange, seen = simulator.world.robot.flange(), flange_now(controller)
        assert seen.coordinates() == pytest.approx(flange.coordinates(), abs=1e-6)
        assert cell.open_requests == []
    assert "WRITE_TOOL" not in cell.commands


def test_six_axes_are_sent_v_and_w_but_four_are_refused(tmp_path, monkeypatch):
    """There is no six-axis EPSON arm here: only the requests are compared."""
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        robot = "robolink.controllers.epson"
        monkeypatch.setattr(f"{robot}.group.EpsonGroup.axes", lambda _: {"joints": (0.0,) * 6})
        monkeypatch.setattr(f"{robot}.link.Robot.six_axes", property(lambda _: True))
        shown = cell.run("calibrate", "pivot", "--tool", "1", "--dry-run", "--json")
        assert shown.code == 0, shown.err
        sent = [line for step in shown.document["steps"] for line in step["requests"]]
        points = [line.split("XY(")[1].split(",") for line in sent if "XY(" in line]
        assert {len(point) for point in points} >= {6}
        assert any(float(point[4]) == -20 for point in points)
        monkeypatch.undo()


def test_limits_lie_about_the_tip_of_a_flange_that_points_down():
    down = Pose(300.0, 0.0, 400.0, 0.0, 0.0, 180.0)
    box = Limits().settings(down, ToolOffset(3.0, 4.0, 100.0)).box
    assert (box.z_min_mm, box.z_max_mm) == pytest.approx((270.0, 350.0))
    assert (box.x_min_mm, box.x_max_mm) == pytest.approx((145.0, 455.0))


def test_an_undefined_tool_is_not_swung_about():
    with pytest.raises(ConfigError, match="not defined"):
        PivotSource(informative_tilts(3, 20.0)).procedure(None, Pose(0, 0, 0, 0))
