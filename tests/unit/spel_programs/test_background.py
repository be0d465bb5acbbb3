"""Background tasks, and what only they or no normal task may (docs/reference/spel.md 4.5)."""

import pytest
from robolink_simulators.epson.options import EpsonOptions, options_from_text
from robolink_simulators.epson.remote.commands import preferences_of
from robolink_simulators.epson.spel.tasks.task import TaskKind

from robolink.errors import ConfigError
from robolink.protocols.epson_text import Preference

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
