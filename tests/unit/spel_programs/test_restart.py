"""Restart and StartMain (docs/reference/spel.md 4.5)."""

import pytest
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.spel.tasks.task import TaskKind

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
    """P. 855; before, it was ended and begun anew whenever time went on."""
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
