"""Poses of a tool near the flange: robolink asks what they cannot show, and never guesses."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.controllers import SimpleController, SimpleMachine
from robolink.methods import PointsSource
from robolink.model import EntryKind, Pose, ToolOffset, rotate_xy

SMALL = ToolOffset(0.7, -0.55, -20.0)
"""0.9 mm from the axis, as a coaxial nozzle."""
REAL = ToolOffset(0.78, -0.5, -20.0)
PIN = (300.0, 100.0)


def touching(u_deg, believed=None):
    """Return a pose on the pin, of the flange or of the tip of a tool that is believed there."""
    own = believed or ToolOffset()
    x, y = rotate_xy(REAL.x_mm - own.x_mm, REAL.y_mm - own.y_mm, u_deg)
    return Pose(PIN[0] - x, PIN[1] - y, -40.0 - REAL.z_mm + own.z_mm, u_deg)


OF_FLANGE = [touching(10), touching(-170)]
OF_TOOL = [touching(10, SMALL), touching(-170, SMALL)]


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=7)
    simulator.machine.tools.set(1, SMALL)
    store = simulator.machine.points.store
    for number, pose in zip((901, 902, 911, 912), (*OF_FLANGE, *OF_TOOL), strict=True):
        store(number, Point.at(pose))
    register("small-tool", simulator)
    yield simulator
    unregister("small-tool")


@pytest.fixture
def command(simulator, capsys):
    def run(*words):
        capsys.readouterr()
        code = main.run(["-c", "epson+sim://small-tool", *words])
        return code, capsys.readouterr().out

    return run


def stored(simulator):
    return simulator.machine.tools.defined()[1]


def sources(tmp_path, poses, points):
    """Return the options by which the same poses can be given."""
    table = tmp_path / "touches.csv"
    rows = [f"{p.x_mm},{p.y_mm},{p.z_mm},{p.u_deg}" for p in poses]
    table.write_text("\n".join(["x,y,z,u", *rows]) + "\n", encoding="utf-8")
    typed = [word for row in rows for word in ("--pose", row)]
    return {"--points": ["--points", points], "--poses": ["--poses", str(table)], "--pose": typed}


@pytest.mark.parametrize("given", ["--points", "--poses", "--pose"])
@pytest.mark.parametrize("poses", [OF_FLANGE, OF_TOOL], ids=["of the flange", "of the tool"])
def test_off_a_terminal_they_are_refused_with_the_option_that_answers(
    command, simulator, tmp_path, given, poses
):
    points = "901,902" if poses is OF_FLANGE else "911,912"
    words = ["calibrate", "two-pose", "--tool", "1", *sources(tmp_path, poses, points)[given]]
    code, out = command(*words, "--yes", "--json")
    error = json.loads(out)["error"]
    assert (code, error["code"]) == (7, "taught_tool_unknown")
    assert "0.890 mm apart" in error["what"]
    assert "--taught-tool 0 or --taught-tool 1" in error["remedy"]
    assert stored(simulator) == SMALL
    right = "0" if poses is OF_FLANGE else "1"
    code, out = command(*words, "--yes", "--json", "--taught-tool", right)
    assert code == 0, out
    assert stored(simulator).components()[:2] == pytest.approx((0.78, -0.5), abs=2e-3)


def test_a_recipe_that_does_not_say_it_is_refused_too(command, simulator, tmp_path):
    recipe = tmp_path / "recipe.toml"
    text = """
schema = "robolink/recipe/1"
name = "points"
basis = "absolute"
z = "kept"
[source]
kind = "points"{more}
[station]
id = "PIN"
[[tools]]
number = 1
points = [911, 912]
"""
    recipe.write_text(text.format(more=""), encoding="utf-8")
    code, out = command("recalibrate", str(recipe), "--yes", "--json")
    assert (code, json.loads(out)["error"]["code"]) == (7, "taught_tool_unknown")
    assert stored(simulator) == SMALL
    recipe.write_text(text.format(more="\ntaught_tool = 1"), encoding="utf-8")
    assert command("recalibrate", str(recipe), "--yes", "--json")[0] == 0
    assert stored(simulator).components()[:2] == pytest.approx((0.78, -0.5), abs=2e-3)


class Person:
    """Answers each question with the next word."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def tell(self, text):
        pass

    def ask(self, question, kind):
        self.asked.append(question)

    def poll(self, wait_s):
        return self.answers.pop(0)


@pytest.mark.parametrize(
    ("answers", "poses"), [(("y",), OF_TOOL), (("n", "y"), OF_FLANGE)], ids=["tool", "flange"]
)
def test_a_person_is_asked_and_the_answer_is_on_record(answers, poses):
    person = Person(*answers)
    plan = ChangePlan(
        (ToolPlan(1, PointsSource(lambda: poses, axes_held=True), verify=False),),
        ask_before_write=False,
        attended=True,
    )
    machine = SimpleMachine({1: SMALL})
    with SimpleController(machine) as controller:
        NozzleChange(controller, plan, operator=person).run()
        recorded = [
            one.details["question"]
            for one in controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
            if "alike" in str(one.details.get("question"))
        ]
    written = machine.read(1)
    assert written is not None
    assert written.components()[:2] == pytest.approx((0.78, -0.5), abs=1e-6)
    assert len(person.asked) == len(answers)
    assert all("fit tools 0, 1 alike" in question for question in person.asked)
    assert set(recorded) >= {question.partition(" [")[0] for question in person.asked}


def test_who_does_not_know_writes_nothing():
    from robolink.errors import CalibrationError

    plan = ChangePlan(
        (ToolPlan(1, PointsSource(lambda: OF_TOOL, axes_held=True), verify=False),),
        ask_before_write=False,
        attended=True,
    )
    machine = SimpleMachine({1: SMALL})
    with SimpleController(machine) as controller, pytest.raises(CalibrationError) as caught:
        NozzleChange(controller, plan, operator=Person("n", "n")).run()
    assert caught.value.code == "taught_tool_unknown"
    assert machine.read(1) == SMALL


@pytest.mark.parametrize("length_mm", [0.05, 0.3, 0.9, 1.4])
def test_however_small_the_tool_is_the_wrong_one_is_never_taken_in_silence(length_mm):
    from robolink.errors import CalibrationError

    small = ToolOffset(length_mm, 0.0, -20.0)
    real = ToolOffset(length_mm + 0.02, 0.01, -20.0)
    poses = []
    for u_deg in (0.0, 180.0):
        x, y = rotate_xy(real.x_mm - small.x_mm, real.y_mm - small.y_mm, u_deg)
        poses.append(Pose(300.0 - x, 100.0 - y, -60.0, u_deg))
    with SimpleController(SimpleMachine({1: small})) as controller:
        with pytest.raises(CalibrationError) as caught:
            PointsSource(lambda: poses).find(controller, 1, small)
        said = PointsSource(lambda: poses, taught_tool=1).find(controller, 1, small)
    assert caught.value.code == "taught_tool_unknown"
    assert said.result.offset.x_mm == pytest.approx(real.x_mm)


def test_a_long_tool_is_not_asked_about():
    stored, real = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.2, -3.9, -20.0)
    poses = []
    for u_deg in (0.0, 180.0):
        x, y = rotate_xy(real.x_mm, real.y_mm, u_deg)
        poses.append(Pose(300.0 - x, 100.0 - y, -60.0, u_deg))
    with SimpleController(SimpleMachine({1: stored})) as controller:
        found = PointsSource(lambda: poses).find(controller, 1, stored)
    assert found.result.offset.x_mm == pytest.approx(12.2)
