"""Background tasks, Restart, and Recover after the safeguard (docs/reference/spel.md 4.5)."""

import math

import pytest
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.options import EpsonOptions, options_from_text
from robolink_simulators.epson.remote.commands import preferences_of
from robolink_simulators.epson.spel.tasks.task import TaskKind

from robolink.errors import ConfigError
from robolink.protocols.epson_text import Preference

# Background tasks, and statements allowed to them alone, or not to normal tasks
# (docs/reference/spel.md 4.5).

WATCHING = """
Global Integer g_passes
Function main
  g_passes = g_passes + 1
  Print "main", g_passes
  Wait 0.2
Fend
Function bgmain
  Xqt log
  Do
    Wait 0.5
    If WindowsStatus = 3 And TaskState(main) = 0 Then StartMain main
  Loop
Fend
Function log
  Print "log", MyTask, TaskInfo(MyTask, 2)
Fend
"""


def shown(made):
    return "".join(made.runner.console).splitlines()


def test_they_begin_with_the_controller_and_start_the_program(cell):
    made = cell(WATCHING, background_tasks="bgmain", windows_status=3)
    made.simulator.advance(1_600_000_000)
    assert shown(made) == ["log 66 4", "main 1", "main 1", "main 1"]
    assert next(task.kind for task in made.runner.tasks.values()) is TaskKind.BACKGROUND


def test_what_startmain_clears_is_kept_where_the_preference_says_so(cell):
    made = cell(WATCHING, background_tasks="bgmain", windows_status=3, globals_at_start="kept")
    made.simulator.advance(1_600_000_000)
    assert shown(made)[1:] == ["main 1", "main 2", "main 3"]


def test_they_outlive_a_stop_and_begin_again_after_a_power_cycle(cell):
    made = cell(WATCHING, background_tasks="bgmain")
    made.runner.start("main", 0)
    made.simulator.panel.press_estop()
    made.simulator.advance(300_000_000)
    assert list(made.runner.tasks) == [65]
    made.simulator.restart()
    made.simulator.advance(400_000_000)
    assert list(made.runner.tasks) == [65]
    assert shown(made).count("log 66 4") == 2


@pytest.mark.parametrize("name", ["nobody", "log,shown", ",".join(["log"] * 17)])
def test_what_cannot_begin_is_refused(cell, name):
    made = cell(background_tasks=name)
    with pytest.raises(ConfigError):
        made.load("Function log\nFend\nFunction shown(n As Integer)\nFend\n")
    assert made.simulator.program is None


@pytest.mark.parametrize(
    "line",
    [
        "StartMain main",
        "Cont",
        "Reset Error",
    ],
)
def test_the_preference_forbids_advanced_commands(cell, line):
    program = (
        f"Function main\nFend\nFunction bg\n  OnErr GoTo no\n  {line}\nno:\n  Print Err\nFend\n"
    )
    made = cell(program, background_tasks="bg", advanced_task_commands=False)
    made.simulator.advance(100_000_000)
    assert shown(made) == [str(made.simulator.options.numbers.preference_off)]
    permitted = cell(program, background_tasks="bg")
    permitted.simulator.advance(100_000_000)
    assert shown(permitted) == ["0"]


@pytest.mark.parametrize(
    "line",
    ["Restart", "Reset", "Trap Error Xqt bg", "Trap 1, Sw(1) = On Xqt bg", "WaitPos", "Tool 1"],
)
def test_what_a_background_task_may_not(cell, line):
    made = cell(
        f"Function main\nFend\nFunction bg\n  OnErr GoTo no\n  {line}\nno:\n  Print Err\nFend\n",
        background_tasks="bg",
    )
    made.simulator.advance(100_000_000)
    assert shown(made) == ["2295"]


def test_getcontsettings_shows_the_preferences():
    plain = preferences_of(EpsonOptions())
    assert Preference.ADVANCED_TASK_COMMANDS in plain
    assert Preference.GLOBALS_CLEARED_AT_START in plain
    assert Preference.BACKGROUND_TASKS not in plain
    told = {"background_tasks": "a,b", "advanced_task_commands": "no", "globals_at_start": "kept"}
    assert preferences_of(options_from_text(told)) & {
        Preference.ADVANCED_TASK_COMMANDS,
        Preference.GLOBALS_CLEARED_AT_START,
        Preference.BACKGROUND_TASKS,
    } == {Preference.BACKGROUND_TASKS}


TOLD = """
Function main
  Trap Error Xqt told
  {line}
Fend
Function told(number As Integer, robot As Integer, joint As Integer)
  Print number, robot, joint, Errb(0)
Fend
"""


@pytest.mark.parametrize(
    ("line", "expected"), [("Error 8003", "8003 0 0 0"), ("Go P77", "7007 1 0 0")]
)
def test_trap_error_tells_number_robot_and_joint(cell, line, expected):
    """P. 855: three Integer by value."""
    assert cell(TOLD.format(line=line)).run() == [expected]


@pytest.mark.parametrize(
    "parameters",
    [
        "number As Integer",
        "number As Integer, robot As Integer, joint As Long",
        "ByRef number As Integer, robot As Integer, joint As Integer",
        "ByRef number() As Integer, robot As Integer, joint As Integer",
    ],
)
def test_another_function_does_not_build(faults, parameters):
    text = TOLD.format(line="Wait 1")
    wrong = text.replace("number As Integer, robot As Integer, joint As Integer", parameters)
    assert any("told" in fault for fault in faults(wrong))


def test_only_an_error_is_told(faults):
    assert any("told" in fault for fault in faults(TOLD.format(line="Trap Abort Xqt told")))


def test_traps_of_a_program_end_with_it(cell):
    """P. 855: cleared when all normal tasks have ended."""
    made = cell(
        "Function main\n  Trap Error Xqt told\nFend\n"
        "Function main1\n  Error 8001\nFend\nFunction told\n  Print 1\nFend\n"
    )
    assert made.run() == []
    assert made.run("main1") == []
    assert made.runner.failure is not None


def test_errb_tells_the_robot_whose_motion_failed(printed):
    assert printed(
        "OnErr GoTo no",
        "Error 8000",
        "Go P77",
        "Exit Function",
        "no:",
        "Print Err, Errb",
        "EResume Next",
    ) == ["8000 0", "7007 1"]


# Restart and StartMain (docs/reference/spel.md 4.5).

AFTER_ERROR = """
Global Preserve Integer g_runs
Function main
  Trap Error Xqt eTrap
  Trap Abort Xqt aborted
  g_runs = g_runs + 1
  Print "run", g_runs, MyTask
  If g_runs = 1 Then
    Xqt other
    Wait 1
    Error 8000
  EndIf
  Wait 1
  Print "through"
Fend
Function other
  Do
    Wait 0.3
  Loop
Fend
Function aborted
  Print "aborted"
Fend
Function eTrap
  Print "trap"
  Wait 0.2
  Reset Error
  Wait 0.2
  Restart
  Print "never"
Fend
"""


def test_after_an_error_the_program_begins_again(cell):
    made = cell(AFTER_ERROR)
    assert made.run(most_s=30) == ["run 1 1", "trap", "run 2 1", "through"]
    assert made.now_s == pytest.approx(2.4, abs=0.1)


def test_a_pause_is_over_and_what_was_set_is_forgotten(cell):
    made = cell(
        "Global Preserve Integer g_runs\n"
        "Function main\n  g_runs = g_runs + 1\n"
        "  If g_runs = 1 Then\n    Trap 1, Sw(3) = On Xqt other\n    Xqt watch, NoPause\n"
        "    Pause\n  EndIf\n  Wait 1\n  Print g_runs\nFend\n"
        "Function watch\n  Wait 0.5\n  Restart\nFend\nFunction other\n  Print 3\nFend\n"
    )
    assert made.run(most_s=30) == ["2"]


def test_restart_is_refused_while_an_error_stands(cell):
    made = cell(AFTER_ERROR.replace("  Reset Error\n", ""))
    assert made.run(most_s=30) == ["run 1 1", "trap"]
    assert made.runner.failure.number % 10_000


BACKGROUND = """
Function main
  Print "main", MyTask
  Wait 1
Fend
Function bgmain
  Wait 0.5
  StartMain main
  Wait 0.5
  OnErr GoTo refused
  StartMain main
refused:
  Print Err
Fend
"""


def test_startmain_starts_a_program_from_the_background_once(cell):
    made = cell(BACKGROUND, background_tasks="BgMain")
    made.simulator.advance(700_000_000)
    assert made.simulator.condition.task is Task.RUNNING
    assert made.runner.tasks[1].kind is TaskKind.NORMAL
    made.simulator.advance(3_000_000_000)
    assert "".join(made.runner.console).splitlines() == ["main 1", "2295"]
    assert made.simulator.condition.flags().ready


def test_startmain_is_refused_from_a_normal_task(cell):
    made = cell("Function main\n  StartMain main1\nFend\nFunction main1\nFend\n")
    made.run()
    assert made.runner.failure.number % 10_000 == 2295


STOPPING = """
Function main
  Trap Emergency Xqt pressed
  Trap Abort Xqt aborted
  Do
    Wait 0.1
  Loop
Fend
Function pressed
  Wait 0.5
  Print "pressed"
Fend
Function aborted
  Wait 0.5
  Print "aborted"
Fend
"""


@pytest.mark.parametrize("word", ["pressed", "aborted"])
def test_the_trap_of_a_stop_runs_once_and_to_its_end(cell, word):
    """P. 855; it used to be ended and begun anew whenever time went on."""
    made = cell(STOPPING)
    made.runner.start("main", 0)
    made.simulator.advance(200_000_000)
    if word == "pressed":
        made.simulator.panel.press_estop()
    else:
        made.simulator.condition.task = Task.NONE
    for tenth in range(3, 20):
        made.simulator.advance(tenth * 100_000_000)
    assert "".join(made.runner.console).split() == [word]
    assert not made.runner.tasks


# Recover after the safeguard, and motions that were broken off (docs/reference/spel.md 4.5).

GUARDED = """
Function main
  Motor On
  Xqt 9, monitor, NoPause
  Move Here -X(60)
  Print "arrived"
Fend
Function monitor
  Wait SafetyOn
  Wait SafetyOn = False
  Print CtrlInfo(1) And &H2000, RobotInfo(1), CX(RecoverPos) = CX(Here)
  {recover}
  Print Motor, CX(RecoverPos), Dist(RecoverPos, Here) > 1, RobotInfo(1)
  Cont
Fend
"""


def advanced(made, seconds):
    made.simulator.advance(made.simulator.now_ns + round(seconds * 1e9))


def place(made, joints):
    return forward(made.simulator.machine.model, joints).coordinates()[:3]


def ends_after(made, number):
    """Return the ends of the motions after the given number."""
    return [motion.flange_mm for motion in made.simulator.motions(number)]


SEEN = "  Print CtrlInfo(1) And &H6000, RobotInfo(1)\n"


def broken_off(cell, recover):
    return broken_off_of(cell, GUARDED.format(recover=recover))


def broken_off_of(cell, program):
    """Start a motion, open the safeguard during it, move the arm by hand, close the safeguard."""
    made = cell(program)
    made.runner.start("main", 0)
    advanced(made, 0.5)
    arm = made.simulator.machine.arm
    assert arm.moving
    made.simulator.panel.open_guard()
    kept = arm.joints
    advanced(made, 0.1)
    j1, *rest = kept
    arm.place(Joints(j1 + 2, *rest), made.simulator.now_ns)
    made.simulator.panel.close_guard()
    return made, kept


@pytest.mark.parametrize("recover", ["Recover All", "Recover 1, WithMove", "Print Recover"])
def test_the_robot_goes_back_to_where_the_safeguard_opened_and_then_on(cell, recover):
    made, kept = broken_off(cell, recover)
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    assert made.simulator.machine.robot.power_high is False
    back, on = ends_after(made, began)
    assert back == pytest.approx(place(made, kept), abs=1e-6)
    assert math.dist(on, back) > 5
    printed = "".join(made.runner.console).splitlines()
    assert printed[0] == "8192 2 0"
    assert printed[-2:] == ["1 0 -1 0", "arrived"]
    assert printed[1:-2] == (["-1"] if recover.startswith("Print") else [])
    assert made.runner.failure is None


def test_a_program_sees_that_the_robot_is_on_its_way_back(cell):
    watched = GUARDED.replace("  Cont\n", "  Cont\nFend\nFunction watch\n  Wait 0.02\n" + SEEN)
    made, _ = broken_off_of(cell, watched.format(recover="Xqt 10, watch, NoPause\n  Recover All"))
    advanced(made, 20)
    printed = "".join(made.runner.console).splitlines()
    assert printed[:2] == ["8192 2 0", "16384 4"]
    assert printed[-2:] == ["1 0 -1 0", "arrived"]


def test_without_move_only_the_motors_come_on(cell):
    made, kept = broken_off(cell, "Recover 1, WithoutMove")
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    (on,) = ends_after(made, began)
    assert math.dist(on, place(made, kept)) > 5


def test_a_motion_goes_on_after_the_safeguard_with_motors_on_alone(cell):
    made, _ = broken_off(cell, "Motor Off")
    began = made.simulator.machine.arm.moves_started
    advanced(made, 20)
    assert made.runner.failure.number == made.simulator.options.numbers.motors_off
    assert ends_after(made, began) == []
    assert "arrived" not in "".join(made.runner.console)


def test_nothing_is_recovered_while_the_safeguard_is_open(cell):
    text = """Function main
  Xqt 9, monitor, NoPause
  Wait 100
Fend
Function monitor
  Wait SafetyOn
  Recover All
Fend
"""
    made = cell(text)
    made.runner.start("main", 0)
    advanced(made, 0.1)
    made.simulator.panel.open_guard()
    advanced(made, 1)
    assert made.runner.failure.number == made.simulator.options.numbers.guard_open
    assert not made.simulator.machine.motors_on
    assert made.simulator.machine.arm.moves_started == 0


JUMPS = """
Function main
  Motor On
  P1 = Here :Z(-40)
  Go P1
  P2 = P1 -X(40)
  Print JT
  Jump P2 LimZ -10
  Print JT = &H70007
  Sense Sw(3) = Off
  Jump P1 LimZ -10 Sense
  Print JS, JT = &H30003
  Till Sw(3) = Off And CZ(CurPos) < -20
  Jump P1 LimZ -10
  Jump P2 LimZ -10 C0 Till
  Print TillOn, JT And 4
Fend
"""


def test_jt_tells_which_parts_of_a_jump_began_and_ended(cell):
    printed = cell(JUMPS).run()
    assert printed[:3] == ["0", "-1", "-1 -1"]


def test_rot_may_stand_where_the_tool_turns_and_names_of_places_are_told(printed):
    assert printed(
        "P1 = Here +X(1)",
        "P2 = P1 +U(5)",
        "Print ROTOK(P1), ROTOK(P2), ROTOK(P2, P2), ROTOK(P1, P2)",
        "Print CX(Align(P1)) = CX(P1), CU(AlignECP(P2, 1)) = CU(P2)",
        "Print WindowsStatus, ProjectName$, CX(RecoverPos)",
    ) == ["0 -1 0 -1", "-1 -1", "0robolink 0"]
