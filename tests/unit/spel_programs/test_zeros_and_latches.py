"""Zeros of joints and brakes in whole programs (docs/reference/spel.md 7.2)."""

import pytest
from robolink_simulators.epson.spel.source_text import ProgramRefused


def test_programs_set_zeros_and_open_no_brake(cell):
    text = "Function main\n  CalPls 1, 2, 3, 4\n  Print CalPls(2), MHour >= 0\nFend\n"
    assert cell(text).run() == ["2 -1"]
    with pytest.raises(ProgramRefused, match="brake"):
        cell("Function main\n  Brake Off, 1\nFend\n")


def test_a_task_that_goes_on_through_a_stop_calibrates_nothing(cell):
    text = """Function main
  Xqt 2, watch, NoEmgAbort
  TaskWait 2
Fend
Function watch
  Calib 1
Fend
"""
    made = cell(text)
    made.run()
    assert made.runner.failure.number == made.simulator.options.numbers.not_in_this_task


LATCHING = """Function main
  Motor On
  SetLatch 24, SETLATCH_TRIGGERMODE_LEADINGEDGE, 2
  LatchEnable On
  Xqt switch
  Move Here -X(60) CP
  Wait LatchState = True
  Print Dist(LatchPos(WithToolArm, 1), LatchPos(WithToolArm, 2)) > 1
  Print Dist(LatchPos, Here) > 1
  LatchEnable Off
Fend
Function switch
  Wait 0.3
  SetSw 24, 1
  SetSw 24, 0
  Wait 0.2
  SetSw 24, 1
Fend
"""


def test_a_program_waits_for_the_latch_and_asks_where_it_was(cell):
    assert cell(LATCHING, virtual_io=True).run() == ["-1", "-1"]
