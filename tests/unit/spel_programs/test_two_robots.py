"""Tasks that move two robots of one controller side by side."""

import pytest
from robolink_simulators.epson import EpsonSimulator

PROGRAM = """
Global Integer done
Function main
  Xqt six
  Robot 1
  Motor On
  Print Robot, MyTask
  Move Here -X(60)
  Print Robot, RobotType
  Wait done = 1
  Print Robot, done
Fend
Function six
  Robot 2
  Motor On
  Move Here +Z(-60)
  Print Robot, RobotType
  done = 1
Fend
"""

IN_TURN = """
Function main
  Robot 2
  Motor On
  Xqt other
  Move Here +Z(-60)
  Print "moved"
Fend
Function other
  Wait 0.05
  Print Robot
  Move Here +Z(-5)
Fend
"""

HALTED = """
Function main
  Motor On
  Xqt six
  Wait 0.3
  Halt six
  Move Here -X(60)
  Resume six
Fend
Function six
  Robot 2
  Motor On
  Move Here +Z(-60)
Fend
"""


def run(simulator, runner):
    """Run a program to its end; tell which robots moved at one time, at each instant."""
    moved = set()
    runner.start("main", simulator.now_ns)
    while runner.tasks:
        simulator.advance(simulator.next_change())
        moved.add(tuple(robot.arm.moving for robot in simulator.machine.robots))
    return moved


@pytest.fixture
def loaded(tmp_path):
    """Return a maker of controllers with a SCARA, six axes and a program."""

    def make(text):
        (tmp_path / "main.prg").write_text(text)
        simulator = EpsonSimulator("GX4-C351S,C8-C901SR")
        return simulator, simulator.load([tmp_path / "main.prg"])

    return make


def test_each_task_moves_the_robot_that_it_chose(loaded):
    simulator, runner = loaded(PROGRAM)
    scara, six = simulator.machine.robots
    before = [robot.tip() for robot in (scara, six)]
    moved = run(simulator, runner)
    assert runner.failure is None, runner.failure
    assert (True, True) in moved
    assert scara.tip().x_mm == pytest.approx(before[0].x_mm - 60)
    assert six.tip().z_mm == pytest.approx(before[1].z_mm - 60)
    shown = sorted("".join(runner.console).splitlines())
    assert shown == ["1 1", "1 1", "1 3", "2 5"], shown
    # What a task chooses is its own affair: the command window keeps its robot.
    assert simulator.machine.robot_number == 1


def test_a_robot_is_moved_by_one_task_at_a_time(loaded):
    simulator, runner = loaded(IN_TURN)
    run(simulator, runner)
    assert runner.failure is not None
    assert (runner.failure.number, runner.failure.function) == (2200, "other")
    assert "".join(runner.console).split() == ["2"]


def test_halt_holds_the_robot_of_the_task_that_is_halted(loaded):
    simulator, runner = loaded(HALTED)
    scara, six = (robot.tip() for robot in simulator.machine.robots)
    moved = run(simulator, runner)
    assert runner.failure is None, runner.failure
    assert {(False, True), (True, False)} <= moved
    assert (True, True) not in moved
    after = [robot.tip() for robot in simulator.machine.robots]
    assert (after[0].x_mm, after[1].z_mm) == pytest.approx((scara.x_mm - 60, six.z_mm - 60))


def test_an_execute_is_refused_while_a_task_moves_the_other_robot(loaded):
    """Ready is off while a task runs, whichever robot it moves (docs/reference/epson.md 1.7)."""
    simulator, _ = loaded(PROGRAM)
    link = simulator.connect(0)

    def ask(request):
        link.receive(f"{request}\r\n".encode(), simulator.now_ns)
        return link.outgoing().decode().strip()

    assert ask("$Login,") == "#Login,0"
    assert ask("$SetMotorsOn,0") == "#SetMotorsOn,0"
    assert ask("$Start,0") == "#Start,0"
    scara, six = simulator.machine.robots
    while not (scara.arm.moving and six.arm.moving):
        simulator.advance(simulator.next_change())
    assert ask('$Execute,"Move Here +X(5)"') == "!Execute,20"
    # Stop is for all of them.
    assert ask("$Stop") == "#Stop,0"
    simulator.advance(simulator.now_ns + 10_000_000)
    assert not scara.arm.moving
    assert not six.arm.moving
    assert ask('$Execute,"Robot 2; Print Robot"').startswith('#Execute,"2')
