"""Two robots of one controller, side by side and by SYNC (docs/reference/spel.md 7.1)."""

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.condition import Task

# Tasks that move two robots of one controller side by side.

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
    """Run a program to its end; return which robots moved at each instant."""
    moved = set()
    runner.start("main", simulator.now_ns)
    while runner.tasks:
        simulator.advance(simulator.next_change())
        moved.add(tuple(robot.arm.moving for robot in simulator.machine.robots))
    return moved


@pytest.fixture
def loaded(tmp_path):
    """Makes controllers with a SCARA, a six-axis arm and a program."""

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
    # A task's choice applies to itself: the command window keeps its robot.
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
    # Stop applies to all of them.
    assert ask("$Stop") == "#Stop,0"
    simulator.advance(simulator.now_ns + 10_000_000)
    assert not scara.arm.moving
    assert not six.arm.moving
    assert ask('$Execute,"Robot 2; Print Robot"').startswith('#Execute,"2')


# Motions that are reserved with SYNC, and SyncRobots (docs/reference/spel.md 7.1).

TOGETHER = """
Function main
  Xqt first
  Xqt second
  Do
    Wait 0.1
    If (SyncRobots And &H03) = &H03 Then Exit Do
  Loop
  {between}
  SyncRobots {which}
  Print SyncRobots
Fend
Function first
  Robot 1
  Motor On
  Move Here -X(60) SYNC
  Print "first"
Fend
Function second
  Robot 2
  Motor On
  Wait 0.037
  Go Here +Z(-60) SYNC !D50; On 7!
  Print "second"
Fend
"""


class Pair:
    """A controller with a SCARA and a six-axis arm, and a program."""

    def __init__(self, folder, text):
        (folder / "main.prg").write_text(text)
        self.simulator = EpsonSimulator("GX4-C351S,C8-C901SR")
        self.runner = self.simulator.load([folder / "main.prg"])

    def run(self, until_s=100):
        """Start main and let time pass; return the output."""
        self.runner.start("main", self.simulator.now_ns)
        return self.go_on(until_s)

    def go_on(self, until_s=100):
        end_ns = self.simulator.now_ns + until_s * 1_000_000_000
        while self.runner.tasks:
            change = self.simulator.next_change()
            if change is None or change > end_ns:
                break
            self.simulator.advance(change)
        return "".join(self.runner.console).splitlines()

    @property
    def began(self):
        """Return the time at which each robot began to move."""
        motions = [*self.simulator.motions()][::-1]  # so that the first of each robot stays
        return {motion.robot: motion.at_ns for motion in motions}

    @property
    def robots(self):
        return self.simulator.machine.robots


@pytest.fixture
def pair(tmp_path):
    return lambda text: Pair(tmp_path, text)


@pytest.mark.parametrize("which", ["1, 2", "All", "2, 1"])
def test_reserved_robots_begin_at_one_instant_and_their_tasks_wait_for_the_end(pair, which):
    made = pair(TOGETHER.format(between="", which=which))
    printed = made.run()
    assert made.began[1] == made.began[2]
    assert printed[0] == "0"  # SyncRobots waits for no end
    assert sorted(printed[1:]) == ["first", "second"]
    assert made.runner.failure is None
    assert made.simulator.machine.outputs.get(7)


def test_no_robot_moves_before_and_one_that_is_named_alone_leaves_the_other(pair):
    made = pair(TOGETHER.format(between="Wait 5; Print SyncRobots", which="2"))
    printed = made.run(until_s=4)
    assert made.began == {}
    assert made.simulator.machine.robots[1].arm.moves_started == 0
    printed = made.go_on(until_s=60)
    assert printed == ["3", "1", "second"]
    assert list(made.began) == [2]
    assert [task.name for task in made.runner.tasks.values()] == ["first"]


REFUSED = """
Function main
  OnErr GoTo told
  Robot 1
  Motor On
  {statement}
  Exit Function
told:
  Print Err
  EResume Next
Fend
Function reserve
  Robot 1
  Go Here -X(20) SYNC
Fend
"""


@pytest.mark.parametrize(
    ("statement", "kind"),
    [
        ("SyncRobots 1", "not_reserved"),
        ("SyncRobots 3", "robot_number"),
        ("SyncRobots", "syntax"),
        ("Xqt reserve; Wait 0.1; Go Here -X(5) SYNC", "robot_in_use"),
        ("Xqt reserve; Wait 0.1; Go Here -X(5)", "robot_in_use"),
        ("Xqt reserve; Wait 0.1; PTran 1, 10", "robot_in_use"),
        ("Go XY(9999, 0, 0, 0) SYNC", "out_of_reach"),
        ("Pass Here -X(5) SYNC", "syntax"),
    ],
)
def test_what_cannot_be_reserved_or_released_is_refused_and_nothing_moves(pair, statement, kind):
    made = pair(REFUSED.format(statement=statement))
    printed = made.run(until_s=10)
    assert printed == [str(getattr(made.simulator.options.numbers, kind))]
    assert [robot.arm.moves_started for robot in made.robots] == [0, 0]


@pytest.mark.parametrize(
    "ending", ["Quit first", "AbortMotion 1", "Motor Off; SyncRobots 1", "Quit All"]
)
def test_a_reservation_ends_with_its_task_and_moves_nothing(pair, ending):
    made = pair(TOGETHER.format(between=f"{ending}; Wait 0.1", which="All"))
    made.run(until_s=20)
    assert 1 not in made.began
    assert made.robots[0].reserved is None


def test_a_robot_that_is_released_in_a_pause_begins_when_the_pause_ends(pair):
    text = """
Function main
  Xqt held
  Xqt 9, free, NoPause
Fend
Function held
  Robot 2
  Motor On
  Go Here +Z(-30) SYNC
Fend
Function free
  Wait 1
  SyncRobots All
Fend
"""
    made = pair(text)
    made.run(until_s=0)
    made.simulator.advance(500_000_000)
    made.simulator.panel.open_guard()
    made.go_on(until_s=5)
    assert made.began == {}
    made.simulator.panel.close_guard()
    made.simulator.machine.switch_all_motors(True)
    made.runner.turn_to(Task.RUNNING)
    made.go_on(until_s=20)
    assert list(made.began) == [2]


def test_the_command_window_reserves_and_a_program_releases(login, tmp_path):
    (tmp_path / "main.prg").write_text("Function main\n  Wait 3\n  SyncRobots All\nFend\n")
    simulator = EpsonSimulator("GX4-C351S")
    simulator.load([tmp_path / "main.prg"])
    client = login(simulator)
    assert client.ask("$SetMotorsOn,1") == "#SetMotorsOn,0"
    assert not client.ask('$Execute,"Go Here -X(20) SYNC"')
    assert not client.wait(2.0)
    assert simulator.machine.robots[0].arm.moves_started == 0
    simulator.panel.start_production()
    answer = ""
    for _ in range(40):
        answer = answer or client.wait(0.5)
    assert answer == "#Execute,0"
    assert simulator.machine.robots[0].arm.moves_started == 1
