"""Tasks, errors, waiting, signals. Pages are those of the language reference."""

import pytest
from robolink_simulators.epson.condition import Task


def test_an_error_is_dealt_with_and_the_next_statement_follows(printed):
    """Check 32: p. 569."""
    lines = ("OnErr GoTo h", "Real x", "x = CX(P900)", 'Print "after"', "GoTo e", "h:")
    assert printed(*lines, "Print Err, Erl", "EResume Next", "e:") == ["7007 4", "after"]


def test_the_failed_statement_is_tried_again(printed):
    """P. 306: with the failed call, if the error occurred deeper."""
    lines = ("OnErr GoTo h", "Integer n", "Print CX(P900)", "Exit Function", "h:", "n = n + 1")
    assert printed(*lines, "If n = 2 Then P900 = XY(7, 0, 0, 0)", "EResume") == ["7"]


def test_a_handler_takes_the_errors_of_functions_that_were_called(cell):
    made = cell(
        "Function main\nOnErr GoTo h\nPrint deep(1)\nPrint 2\nExit Function\nh:\n"
        "Print Err, Erf$\nEResume Next\nFend\n"
        "Function deep(n As Integer) As Integer\nWait 0.1\nError 8001\nFend\n"
    )
    assert made.run() == ["8001deep", "2"]


def test_a_handler_may_stand_in_the_loop_that_it_serves(printed):
    """P. 306; a public program reconnects like that."""
    lines = ("OnErr GoTo again", "Integer n", "Do", "again:", "If Err Then EResume go", "go:")
    rest = ("n = n + 1", "If n < 3 Then Error 8000 + n", "Exit Do", "Loop", "Print n")
    assert printed(*lines, *rest) == ["3"]


def test_an_error_in_the_handler_ends_the_task(failure):
    """Otherwise a program that fails in its error handling would never end."""
    told = failure("OnErr GoTo h", "Error 8001", "h:", "Error 8002", "EResume")
    assert (told.number, told.line) == (8002, 5)


def test_onerr_is_taken_away(failure):
    assert failure("OnErr GoTo h", "OnErr GoTo 0", "Error 8003", "h:").number == 8003


def test_an_error_that_nobody_deals_with_is_shown_with_its_line(cell):
    made = cell("Function main\nXqt other\nPrint 1\nGo P900\nFend\nFunction other\nWait 9\nFend\n")
    made.run()
    condition = made.simulator.condition
    assert condition.error
    assert condition.code == 7007
    assert condition.task is Task.NONE
    assert made.runner.tasks == {}
    assert "main.prg:4" in condition.failure[1]


def test_two_tasks_run_side_by_side_while_the_robot_moves(cell):
    """Check 38: p. 556, 912."""
    made = cell(
        'Function main\nXqt f\nPrint MyTask, TaskState(f)\nGo Here +X(-50)\nPrint "there"\nFend\n'
        "Function f\nInteger i\nFor i = 1 To 3\nPrint MyTask\nWait 0.01\nNext\nFend\n"
    )
    assert made.run() == ["1 1", "2", "2", "2", "there"]


def test_two_tasks_do_not_move_one_robot(cell):
    made = cell(
        "Function main\nXqt f\nGo Here +X(-50)\nFend\nFunction f\nWait 0.01\n"
        "Go Here +Z(-10)\nFend\n"
    )
    made.run()
    assert made.runner.failure.function == "f"


def test_tasks_are_halted_resumed_and_ended_by_number_or_function(cell):
    """P. 360, 664, 690, 815."""
    made = cell(
        "Global Integer n\nFunction main\nXqt 5, f\nWait 0.105\nHalt f\nPrint n, TaskState(5)\n"
        "Wait 0.1\nPrint n\nResume 5\nWait 0.1\nPrint n > 15\nQuit f\nWait 0\n"
        "Print TaskState(f), TaskDone(5)\nFend\n"
        "Function f\nDo\nn = n + 1\nWait 0.01\nLoop\nFend\n"
    )
    assert made.run() == ["11 3", "11", "-1", "0 -1"]


def test_quit_all_ends_every_task_and_puts_motion_parameters_back(cell):
    made = cell(
        "Function main\nPower High\nSpeed 50\nXqt f\nWait 0.1\nQuit All\nPrint 1\nFend\n"
        "Function f\nDo\nWait 1\nLoop\nFend\n"
    )
    assert made.run() == []
    assert not made.simulator.machine.power_high
    assert made.simulator.machine.parameters.speed[0] < 50


def test_waiting_for_a_task_and_its_number(cell):
    made = cell(
        "Function main\nXqt TaskReserve, f(2), Normal\nTaskWait f\nPrint Tmr(0) > 0.4\n"
        "Xqt 1, f(1)\n"
        "Fend\nFunction f(n As Integer)\nWait 0.5\nFend\n"
    )
    assert made.run() == ["-1"]
    assert made.runner.failure.number == 2503


def test_a_wait_for_a_condition_tells_by_tw_how_it_ended(printed):
    """Check 33: p. 859, 881; also with variables that do not change (check 13 of programs)."""
    lines = ("Wait MemSw(9) = On, 0.5", "Print TW, Tmr(0) >= 0.5", "MemOn 9")
    assert printed(*lines, "Wait MemSw(9) = On, 0.5", "Print TW") == ["-1 -1", "0"]


def test_the_limit_of_waits_is_an_error(failure):
    """Check 34: p. 842."""
    assert failure("TMOut 1", "Wait MemSw(9) = On").number == 2280


def test_a_wait_takes_a_variable_that_another_task_sets(cell):
    """P. 882; ambiguity 6: the comma ends the condition."""
    made = cell(
        "Integer flag\nGlobal Boolean b\nFunction main\nXqt f\nWait flag <> 0\nPrint flag\n"
        "Wait b = True Or Sw(3) = On, 5\nPrint TW, Tmr(0) < 1\nFend\n"
        "Function f\nWait 0.2\nflag = 3; Wait 0.02\nb = True\nFend\n"
    )
    assert made.run() == ["3", "0 -1"]


def test_the_right_side_of_a_condition_is_worked_out_once(cell):
    """P. 882."""
    made = cell(
        "Integer a, limit\nFunction main\nlimit = 2\nXqt f\nWait a >= limit\nPrint a, limit\nFend\n"
        "Function f\nWait 0.1\nlimit = 9\nWait 0.1\na = 2\nFend\n"
    )
    assert made.run() == ["2 9"]


def test_an_input_that_a_hand_switches_ends_a_wait(cell):
    made = cell('Function main\nWait Sw(4)\nPrint "on"\nFend\n')
    made.runner.start("main", 0)
    made.simulator.advance(10**9)
    assert list(made.runner.console) == []
    made.simulator.panel.switch_input(4, True)
    made.simulator.advance(11 * 10**8)
    assert list(made.runner.console) == ["on\r\n"]


def test_outputs_switch_back_with_and_without_waiting(printed):
    """Check 35: p. 567."""
    lines = ("On 3, 0.2, 0", "Print Tmr(0) < 0.01, Oport(3)", "Wait 0.3", "Print Oport(3)")
    assert printed(*lines, "TmReset 1", "On 3, 0.2", "Print Tmr(1) > 0.19") == ["-1 1", "0", "-1"]


def test_a_lock_is_taken_once_and_given_back_by_its_owner(failure, cell):
    """Check 36: p. 799, 801."""
    assert failure("SyncLock 5", "SyncLock 5").line == 3
    made = cell(
        "Function main\nSyncLock 5\nXqt f\nWait 0.1\nSyncUnlock 5\nWait 1\n"
        "SyncLock 5, 0.1\nPrint TW\n"
        'Fend\nFunction f\nOnErr GoTo h\nSyncUnlock 5\nPrint "took"\nh:\nPrint "refused"\n'
        "SyncLock 5, 0.01\nPrint TW\nSyncLock 5\nPrint TW\nWait 5\nFend\n"
    )
    assert made.run() == ["refused", "-1", "0", "-1"]


def test_a_task_that_ends_gives_its_locks_back(cell):
    made = cell(
        "Function main\nXqt f\nWait 0.1\nSyncLock 5\nPrint TW\nFend\nFunction f\nSyncLock 5\nFend\n"
    )
    assert made.run() == ["0"]


def test_a_signal_that_came_too_early_is_lost(cell):
    """P. 758, 886; check 12 of programs."""
    made = cell(
        "Function main\nXqt f\nSignal 1\nWait 0.2\nSignal 2\nFend\n"
        "Function f\nWait 0.1\nWaitSig 1, 0.5\nPrint TW\nWaitSig 2, 0.5\nPrint TW\nFend\n"
    )
    assert made.run() == ["-1", "-1"]
    made = cell(
        "Function main\nXqt f\nWait 0.2\nSignal 1\nFend\nFunction f\nWaitSig 1\n"
        "Print Tmr(0) > 0.1\n"
        "Fend\n"
    )
    assert made.run() == ["-1"]


def test_a_loop_that_never_waits_is_ended(failure):
    """P. 289: 2556; how many passes is an option."""
    told = failure("Do", "Loop", loop_passes=1000)
    assert (told.number, told.line) == (2556, 3)


def test_a_loop_that_waits_is_not(printed):
    lines = ("Integer i", "For i = 1 To 300", "If i Mod 50 = 0 Then Wait 0", "Next", "Print i")
    assert printed(*lines, loop_passes=100) == ["301"]


def test_traps_go_elsewhere_start_tasks_and_fire_once(cell):
    """P. 851; ambiguity 14: with and without a comma."""
    made = cell(
        "Function main\nTrap 1, MemSw(1) = On GoTo away\nTrap 2, MemSw(2), Xqt f\nMemOn 2\n"
        'Wait 0.1\nXqt g\nGo Here +X(-50)\nPrint "never"\naway:\nPrint Tmr(0) < 0.3\nFend\n'
        "Function f\nPrint MyTask\nFend\nFunction g\nMemOn 1\nFend\n"
    )
    assert made.run() == ["257", "-1"]
    assert not made.simulator.machine.arm.moving


def test_a_task_that_stops_do_not_touch_may_not_move(cell):
    """P. 912 to 917; check 15 of programs."""
    made = cell(
        "Function main\nXqt f, NoEmgAbort\nWait 1\nFend\nFunction f\nOnErr GoTo h\n"
        'TLSet 1, XY(1, 2, 3, 4)\nPrint "set"\nh:\nPrint Err\nFend\n'
    )
    assert made.run() == ["2295"]


def test_an_emergency_stop_ends_tasks_but_not_those_it_must_not_end(cell):
    made = cell(
        'Function main\nXqt f, NoEmgAbort\nDo\nWait 0.1\nPrint "main"\nLoop\nFend\n'
        'Function f\nWait 1\nPrint "still here"\nFend\n'
    )
    made.runner.start("main", 0)
    made.simulator.advance(250_000_000)
    made.simulator.panel.press_estop()
    made.simulator.advance(2 * 10**9)
    shown = "".join(made.runner.console)
    assert shown.count("main") == 2
    assert "still here" in shown


def test_a_pause_holds_motion_and_time_and_continue_ends_both(cell):
    """P. 882: a timed wait begins anew; p. 912: NoPause goes on."""
    made = cell(
        'Function main\nXqt f, NoPause\nMove Here +X(-40)\nPrint "there", CX(Here)\nFend\n'
        'Function f\nWait 1.5\nPrint "f"\nFend\n'
    )
    start = made.simulator.machine.tip()
    made.runner.start("main", 0)
    made.simulator.advance(300_000_000)
    made.simulator.condition.task = Task.PAUSED
    made.simulator.advance(2 * 10**9)
    between = made.simulator.machine.tip()
    assert list(made.runner.console) == ["f\r\n"]
    assert not made.simulator.machine.arm.moving
    assert start.x_mm - 39 < between.x_mm < start.x_mm
    made.simulator.condition.task = Task.RUNNING
    made.simulator.advance(5 * 10**9)
    assert made.simulator.machine.tip().x_mm == pytest.approx(start.x_mm - 40)
    assert len(made.runner.console) == 2


@pytest.mark.parametrize(
    ("line", "number"), [("WaitSig 3", 2281), ("SyncLock 5", 2281), ("WaitNet #201", 2282)]
)
def test_tmout_bounds_what_has_no_time_of_its_own(cell, line, number):
    """Help, 2281 and 2282; a statement's own time-out is reported by TW, and is no error."""
    made = cell(
        'Function main\nSetNet #201, "127.0.0.1", 1, CRLF, NONE, 0\nOpenNet #201 As Client\n'
        f"Xqt holder\nWait 0.1\nTMOut 2\n{line}, 1\nPrint TW\nTmReset 1\nOnErr GoTo late\n"
        f"{line}\nlate:\nPrint Err, Int(Tmr(1))\nFend\nFunction holder\nSyncLock 5\nWait 20\nFend"
    )
    made.simulator.program.ports.dial = lambda address: NoAnswer()
    assert made.run() == ["-1", f"{number} 2"]


class NoAnswer:
    """A link whose other end never answers."""

    def getsockopt(self, level, name):
        return 0

    def getpeername(self):
        raise OSError

    def close(self):
        pass


ABORTING = """
Function main
Xqt mover
Wait 0.2
{first}
Wait 0.5
{second}
Fend
Function mover
OnErr GoTo caught
Go XY(0, 492, -100, 0)
Wait 5
Exit Function
caught:
Print Err, InPos
EResume onward
onward:
Wait 5
Fend
"""


def test_abortmotion_stops_the_motion_of_another_task_and_raises_its_errors(cell):
    made = cell(ABORTING.format(first="AbortMotion 1", second="AbortMotion All"))
    assert made.run() == ["2999 -1", "2998 -1"]
    assert made.simulator.machine.tip().x_mm > 1


@pytest.mark.parametrize(
    ("line", "number"), [("AbortMotion All\nAbortMotion 1", 2191), ("AbortMotion 3", 2262)]
)
def test_abortmotion_needs_a_robot_that_a_task_has_moved(cell, line, number):
    made = cell(f"Function main\n{line}\nFend\n")
    made.run()
    assert made.runner.failure.number == number
