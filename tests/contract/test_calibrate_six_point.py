"""``calibrate six-point`` live: all six components, on a PLC whose flange tilts."""

from dataclasses import replace

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.calibration import rotation_of
from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Listener,
    NozzleChange,
    ToolPlan,
)
from robolink.errors import VerifyError
from robolink.methods import AxisTeachPlan, SixPointSource, informative_tilts
from robolink.model import Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.runner import Ask, TeachPrompt
from tests.contract._method_cell import method_cell
from tests.contract._softmotion_cell import served
from tests.contract.test_calibrate_pivot import FIVE, QUICK, STORED, plc, run

__all__ = ["plc"]

pytestmark = pytest.mark.simulator_only

TURNED = WorldParameters(tool_u_deg=14.0, tool_v_deg=7.0, tool_w_deg=356.0)


def orientation(offset):
    """Return the rotation of an offset."""
    return rotation_of(Pose(0.0, 0.0, 0.0, *offset.components()[3:]))


def person(simulator, clock, way_mm=12.0):
    eyes = InProcessEyes(simulator)
    return AssistedOperator.with_eyes(eyes, lambda _text: None, way_mm=way_mm, clock=clock)


def change(controller, simulator, *, listener=None, verify=True):
    source = SixPointSource(informative_tilts(2, 20.0), TouchPlan(), ways=AxisTeachPlan(10.0))
    plan = ChangePlan(
        (ToolPlan(1, source, AcceptanceCriteria(), verify=verify),), QUICK, ask_before_write=False
    )
    return NozzleChange(
        controller, plan, operator=person(simulator, controller.clock), listener=listener
    )


def turned_simulator(seed=4):
    return SoftMotionSimulator(FIVE, seed=seed, world=TURNED)


def test_place_and_orientation_are_found_written_and_proved(plc, tmp_path):
    world, page = plc.world, tmp_path / "page.html"
    world.set_up(TURNED)
    words = (
        "calibrate",
        "six-point",
        "--tool",
        "1",
        "--assist",
        plc.url,
        "--yes",
        "--speed",
        "100",
    )
    code, document, said = run(plc.url, *words, "--count", "4", "--report", str(page))
    assert code == 0, said
    assert document["measured"] == list(document["proposed"])
    truth, half = world.tips[1].components(), document["fit"]["half_width95"].values()
    for found, true, width in zip(document["proposed"].values(), truth, half, strict=True):
        assert abs((found - true + 180) % 360 - 180) < 4 * width
    assert max(list(half)[3:]) < 0.1
    assert document["off_square_deg"] == pytest.approx(0.0, abs=0.1)
    assert document["verification"]["passed"]
    assert "You show moves along the tool's axes: 2" in said
    assert "The moves are 0.0" in said
    with_tool = replace(ToolOffset(), **document["proposed"])
    a_deg, b_deg, c_deg = plc.plc.memory.slot(1).tool[3:]
    # The PLC keeps Rz(A) Ry(B) Rz(C).
    kept = (rotation_of(Pose(0, 0, 0, a_deg)) @ rotation_of(Pose(0, 0, 0, 0, b_deg))) @ rotation_of(
        Pose(0, 0, 0, c_deg)
    )
    assert kept == pytest.approx(orientation(with_tool), abs=1e-6)
    text = page.read_text()
    assert "5 (where the moves begin)" in text
    assert "6 (along X)" in text


def test_a_tip_that_slips_is_found_and_place_and_orientation_come_back():
    class Slips(Listener):
        def wrote(self, receipt):
            tip = simulator.world.tips[1]
            simulator.world.tips[1] = replace(tip, z_mm=tip.z_mm - 1.0)
            self.written = simulator.plc.memory.slot(1).tool

    simulator, listener = turned_simulator(), Slips()
    with served("sim", simulator) as cell, cell.connect() as controller:
        with pytest.raises(VerifyError):
            change(controller, simulator, listener=listener).run()
    assert any(abs(angle) > 1 for angle in listener.written[3:])
    assert simulator.plc.memory.slot(1).tool == (*STORED, 0.0, 0.0, 0.0)


def test_ctrl_c_on_a_way_puts_the_tool_back_and_writes_nothing():
    class Leaves(Listener):
        def step(self, tool, done):
            if isinstance(done.step, Ask) and done.step.shown is TeachPrompt.ALONG_X:
                raise KeyboardInterrupt

    simulator = turned_simulator()
    with served("sim", simulator) as cell, cell.connect() as controller:
        with pytest.raises(KeyboardInterrupt):
            change(controller, simulator, listener=Leaves()).run()
        assert controller.tools.selected() == 1
        assert cell.open_requests == []
    assert "WRITE_TOOL" not in cell.commands
    assert simulator.plc.memory.slot(1).tool == (*STORED, 0.0, 0.0, 0.0)


@pytest.mark.soak
def test_over_a_bus_touches_and_ways_go_the_same():
    simulator = turned_simulator(seed=9)
    with served("modbus-tcp", simulator) as cell, cell.connect() as controller:
        # It runs in real time, so the test goes only as far as the write.
        (report,) = change(controller, simulator, verify=False).run().tools
        result, truth = report.proposal.result, simulator.world.tips[1]
        for axis, other in zip(orientation(result.offset).T, orientation(truth).T, strict=True):
            assert axis @ other > 0.9999
        assert cell.commands.count("WRITE_TOOL") == 1
        assert controller.tools.same(controller.tools.read(1), result.offset)


@pytest.mark.parametrize(
    ("words", "code", "what"),
    [
        (("--box", "40", "--yes"), 2, "would leave the allowed area"),
        (("--way", "5", "--yes"), 2, "--way"),
        (("--way", "60", "--pose", "1,2,3,4,5,6"), 2, "is for movements"),
        ((), 9, ""),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(plc, words, code, what):
    ended, document, _ = run(plc.url, "calibrate", "six-point", "--tool", "1", *words)
    assert ended == code, document
    assert what in document["error"]["what"]
    assert plc.plc.group.movements_started == 0


def test_six_axes_of_an_arm_would_do_it_too(tmp_path, monkeypatch):
    """There is no six-axis EPSON arm here: only the steps and requests are compared."""
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        robot = "robolink.controllers.epson"
        monkeypatch.setattr(f"{robot}.group.EpsonGroup.axes", lambda _: {"joints": (0.0,) * 6})
        monkeypatch.setattr(f"{robot}.link.Robot.six_axes", property(lambda _: True))
        shown = cell.run("calibrate", "six-point", "--tool", "1", "--dry-run", "--json")
        assert shown.code == 0, shown.err
        steps = shown.document["steps"]
        assert sum("onto the pin" in step["text"] for step in steps) == 6
        ways = [step["text"] for step in steps if "tool's own" in step["text"]]
        assert ["+X" in way for way in ways] == [True, True, False]
        assert not any(step["refusal"] for step in steps)
        monkeypatch.undo()
